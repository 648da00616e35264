"""The board: its definition, its corners in images, and its print, to scale."""

import re

import cv2
import numpy as np
import pytest
import yaml
from pydantic import ValidationError

from drivers.errors import ConfigError
from rig.calibration.averaging import average_views, largest_motion_px
from rig.calibration.board import BoardConfig, corner_points, opencv_board
from rig.calibration.board_pdf import PAPERS_MM, Paper, board_pdf, definition
from rig.calibration.board_pose import board_pose
from rig.calibration.detection import BoardDetector
from rig.calibration.errors import CalibrationError
from rig.calibration.views import BoardView
from tests.rig.calibration.synthetic import Truth, random_truth, tool_poses, view
from tests.rig.calibration.synthetic_image import picture, print_of

BOARD = BoardConfig()
LEGACY = BoardConfig(
    squares=(6, 8), square_m=0.025, marker_m=0.018, dictionary="DICT_5X5_100", legacy=True
)


@pytest.fixture(scope="module")
def truth() -> Truth:
    return random_truth(1, distortion=False)


@pytest.fixture(scope="module")
def pictures(truth: Truth) -> list[tuple[np.ndarray, np.ndarray]]:
    """Images with the exact pixels (24, 2) of all corners."""
    rng, paper = np.random.default_rng(1), print_of(BOARD)
    poses = tool_poses(truth, 4, 1)
    return [(picture(truth, T, paper, rng), truth.pixels(T)) for T in poses]


def test_the_corners_lie_where_opencv_has_them() -> None:
    for board in (BOARD, LEGACY):
        theirs = np.asarray(opencv_board(board).getChessboardCorners())
        assert np.allclose(corner_points(board), theirs, atol=1e-6)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"marker_m": 0.031}, "marker_m"),
        ({"marker_m": 0.005}, "marker_m"),
        ({"dictionary": "DICT_9X9_50"}, "none of"),
        ({"dictionary": "DICT_4X5_50"}, "none of"),
        ({"squares": (20, 10)}, "100 markers"),
        ({"squares": (2, 5)}, "greater than or equal to 3"),
        ({"side_m": 1.0}, "side_m"),
    ],
)
def test_a_board_that_cannot_be_is_refused(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        BoardConfig.model_validate(wrong)


def test_corners_are_found_to_a_few_hundredths_of_a_pixel(
    pictures: list[tuple[np.ndarray, np.ndarray]],
) -> None:
    detector, off = BoardDetector(BOARD), []
    for image, exact in pictures:
        found = detector.find(image)
        assert found.view is not None, found.reason
        assert found.edge_width_px < 3.0
        assert np.array_equal(found.view.points_m, corner_points(BOARD)[found.view.ids])
        off.append(found.view.pixels - exact[found.view.ids])
    together = np.concatenate(off)
    assert np.sqrt(np.mean(together**2)) < 0.05
    assert np.all(np.abs(np.mean(together, axis=0)) < 0.02)


def test_the_boards_pose_is_found_from_its_picture(
    truth: Truth, pictures: list[tuple[np.ndarray, np.ndarray]]
) -> None:
    T_base_tool = tool_poses(truth, 4, 1)[2]
    found = BoardDetector(BOARD).find(pictures[2][0]).view
    assert found is not None
    off = np.linalg.inv(truth.camera_from_tool(T_base_tool)) @ board_pose(found, truth.intrinsics)
    assert np.linalg.norm(off[:3, 3]) < 1e-3
    assert np.linalg.norm(off[:3, :3] - np.eye(3)) < 0.01


def reason(image: np.ndarray, board: BoardConfig = BOARD) -> str:
    found = BoardDetector(board).find(image)
    assert found.view is None
    return found.reason


def test_each_kind_of_useless_image_has_its_reason(
    pictures: list[tuple[np.ndarray, np.ndarray]],
) -> None:
    image = pictures[0][0]
    assert "nearly uniform" in reason(np.full((480, 640), 90, np.uint8))
    clutter = np.random.default_rng(2).integers(0, 255, (480, 640)).astype(np.uint8)
    assert "no board in view" in reason(clutter)
    assert "blurred" in reason(cv2.GaussianBlur(image, (0, 0), 3.0))
    assert "mirrored" in reason(np.ascontiguousarray(image[:, ::-1]))
    part = np.full_like(image, 60)
    u, v = (int(x) for x in pictures[0][1][9])
    part[max(v - 60, 0) : v + 60, max(u - 60, 0) : u + 60] = image[
        max(v - 60, 0) : v + 60, max(u - 60, 0) : u + 60
    ]
    assert "needed" in reason(part) or "no board in view" in reason(part)


def test_a_wrong_board_is_told_from_none(pictures: list[tuple[np.ndarray, np.ndarray]]) -> None:
    image = pictures[0][0]
    assert "markers are of DICT_4X4" in reason(image, BoardConfig(dictionary="DICT_6X6_50"))
    assert "do not lie as on" in reason(image, BoardConfig(squares=(8, 6)))
    assert "wrong board" in reason(image, BoardConfig(squares=(4, 4)))


def rasterised(pdf: bytes, dpi: float) -> np.ndarray:
    """The rectangles of a page, painted in order; its text is left out."""
    box = re.search(rb"MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert box is not None
    scale = dpi / 72.0
    width, height = (round(float(side) * scale) for side in box.groups())
    image = np.full((height, width), 255, np.uint8)
    for grey, *numbers in re.findall(rb"([01]) g ([\d.]+) ([\d.]+) ([\d.]+) ([\d.]+) re f", pdf):
        x, y, w, h = (float(number) * scale for number in numbers)
        rows = slice(round(height - y - h), round(height - y))
        image[rows, round(x) : round(x + w)] = 255 * int(grey)
    return image


@pytest.mark.parametrize(
    ("board", "paper"), [(BOARD, "a4"), (BOARD, "letter"), (LEGACY, "a4"), (LEGACY, "a3")]
)
def test_the_print_is_to_scale_and_is_detected(board: BoardConfig, paper: Paper) -> None:
    image = rasterised(board_pdf(board, paper), 150.0)
    assert sorted(image.shape) == pytest.approx(
        [side * 150 / 25.4 for side in PAPERS_MM[paper]], abs=1
    )
    found = BoardDetector(board).find(image)
    assert found.view is not None, found.reason
    assert len(found.view) == len(corner_points(board))
    # Pixels by points: the resolution along both axes and nothing across them.
    plane = np.column_stack([found.view.points_m[:, :2], np.ones(len(found.view))])
    by_axis = np.linalg.lstsq(plane, found.view.pixels, rcond=None)[0]
    expected = 150 / 0.0254
    assert np.allclose(by_axis[:2], expected * np.eye(2), atol=0.002 * expected)


def test_the_ruler_is_100_mm_long() -> None:
    image = rasterised(board_pdf(BOARD, "a4"), 254.0)  # ten pixels a millimetre
    ruler = image[-300:]
    longest = max(
        (int(np.ptp(np.flatnonzero(row == 0))) for row in ruler if np.any(row == 0)), default=0
    )
    assert longest == pytest.approx(1000, abs=3)


def test_the_definition_to_copy_is_the_board() -> None:

    for board in (BOARD, LEGACY):
        section = yaml.safe_load(definition(board))["board"]
        assert BoardConfig.model_validate(section) == board
        assert definition(board).encode() in board_pdf(board, "a3").replace(b"\\", b"")


def test_a_board_larger_than_the_paper_says_what_fits() -> None:
    with pytest.raises(ConfigError, match=r"300 x 210 mm does not fit on letter .* at most 24 mm"):
        board_pdf(BoardConfig(squares=(10, 7)), "letter")
    fits = BoardConfig(squares=(10, 7), square_m=0.024, marker_m=0.018)
    assert board_pdf(fits, "letter").startswith(b"%PDF")


def test_the_pdfs_table_of_objects_points_at_them() -> None:
    pdf = board_pdf(BOARD, "a4")
    offsets = [int(n) for n in re.findall(rb"(\d{10}) 00000 n", pdf)]
    assert len(offsets) == 6
    for number, offset in enumerate(offsets, start=1):
        assert pdf[offset:].startswith(b"%d 0 obj" % number)
    start = int(re.search(rb"startxref\n(\d+)", pdf)[1])  # type: ignore[index]
    assert pdf[start:].startswith(b"xref")


def test_averaging_halves_the_noise_of_four_images(truth: Truth) -> None:
    rng, T = np.random.default_rng(5), tool_poses(truth, 1, 5)[0]
    exact = truth.pixels(T)
    several = [[view(truth, T, rng, 0.1) for _ in range(4)] for _ in range(40)]
    means = [average_views(group) for group in several]
    off = np.concatenate([mean.pixels - exact[mean.ids] for mean in means])
    assert np.std(off) == pytest.approx(0.05, rel=0.1)
    assert largest_motion_px(several[0]) < 0.1
    moved = BoardView(several[0][0].ids, several[0][0].points_m, several[0][0].pixels + 0.5)
    assert largest_motion_px([several[0][0], moved]) == pytest.approx(np.hypot(0.5, 0.5), abs=0.1)


def test_a_corner_seen_by_chance_is_not_averaged(truth: Truth) -> None:
    rng, T = np.random.default_rng(6), tool_poses(truth, 1, 6)[0]
    full = view(truth, T, rng)
    less = full.only(np.arange(len(full)) > 0)
    assert len(average_views([full, less, less])) == len(full) - 1
    assert len(average_views([full, full, less])) == len(full)


def test_too_few_or_collinear_corners_give_no_pose(truth: Truth) -> None:
    seen = view(truth, tool_poses(truth, 1, 7)[0], np.random.default_rng(7))
    with pytest.raises(CalibrationError, match="5 corners"):
        board_pose(seen.only(np.arange(len(seen)) < 5), truth.intrinsics)
    row = np.isclose(seen.points_m[:, 1], seen.points_m[0, 1])
    line = BoardView(seen.ids[row], seen.points_m[row], seen.pixels[row])
    doubled = BoardView(
        np.tile(line.ids, 2), np.tile(line.points_m, (2, 1)), np.tile(line.pixels, (2, 1))
    )
    with pytest.raises(CalibrationError, match="one line"):
        board_pose(doubled, truth.intrinsics)
