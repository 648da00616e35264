"""Corners from the edges that meet in them: a hundredth of a pixel, whatever the view."""

import numpy as np
import pytest

from rig.calibration.board import BoardConfig
from rig.calibration.corner_fit import fit_corners
from rig.calibration.detection import BoardDetector
from tests.rig.calibration.synthetic import Truth, random_truth, tool_poses
from tests.rig.calibration.synthetic_image import picture, print_of

BOARD = BoardConfig()


@pytest.fixture(scope="module")
def truth() -> Truth:
    return random_truth(3, distortion=False)


@pytest.fixture(scope="module")
def images(truth: Truth) -> list[tuple[np.ndarray, np.ndarray]]:
    """Pictures of a board with the exact pixels (24, 2) of all corners."""
    rng, paper = np.random.default_rng(5), print_of(BOARD)
    return [(picture(truth, T, paper, rng), truth.pixels(T)) for T in tool_poses(truth, 4, 5)]


def errors_px(image: np.ndarray, exact: np.ndarray, fine: bool) -> np.ndarray:
    found = BoardDetector(BOARD).find(image, fine).view
    assert found is not None
    return np.asarray(found.pixels - exact[found.ids])


def test_they_are_far_more_exact_than_those_from_small_windows(
    images: list[tuple[np.ndarray, np.ndarray]],
) -> None:
    fine = np.concatenate([errors_px(*one, fine=True) for one in images])
    rough = np.concatenate([errors_px(*one, fine=False) for one in images])
    assert np.sqrt(np.mean(fine**2)) < 0.02
    assert np.sqrt(np.mean(fine**2)) < np.sqrt(np.mean(rough**2)) / 2.0
    assert np.abs(fine.mean(axis=0)).max() < 0.005


def test_a_start_half_a_pixel_off_ends_at_the_same_place(
    images: list[tuple[np.ndarray, np.ndarray]],
) -> None:
    image = images[0][0]
    found = BoardDetector(BOARD).find(image).view
    assert found is not None
    off = found.pixels + 0.5 * np.array([np.cos(found.ids), np.sin(found.ids)]).T
    again = fit_corners(image, off, found.points_m[:, :2], BOARD.square_m, BOARD.marker_m)
    assert np.abs(again - found.pixels).max() < 0.03


def test_where_there_are_no_edges_the_corners_stay() -> None:
    grey = np.full((240, 320), 128, dtype=np.uint8)
    points = np.array([[x, y] for x in (0.03, 0.06, 0.09) for y in (0.03, 0.06)])
    corners = 50.0 + 1000.0 * points
    assert np.array_equal(fit_corners(grey, corners, points, 0.03, 0.022), corners)


def test_corners_that_no_board_could_have_are_left_as_they_are() -> None:
    image = np.full((480, 640), 128, np.uint8)
    corners = np.column_stack([np.full(6, 100.0), np.full(6, 200.0)])
    points = np.array([[x, y] for x in (0.0, 0.03, 0.06) for y in (0.0, 0.03)])
    assert np.array_equal(fit_corners(image, corners, points, 0.03, 0.022), corners)
