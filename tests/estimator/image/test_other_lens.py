"""The same outline read through another lens: exact where the answer is known, and by pixels."""

import numpy as np
import pytest

from estimator.image.feature import Feature
from estimator.image.intrinsics import Intrinsics
from estimator.image.other_lens import through_other_lens
from estimator.image.outline import outline_px

SIZE = (640, 480)
LENS = Intrinsics(800.0, 805.0, 322.0, 236.0, np.array([-0.08, 0.03, 5e-4, -5e-4, 0.0]))
OTHER = Intrinsics(806.0, 811.0, 320.5, 238.0, np.array([-0.07, 0.02, 0.0, 3e-4, 0.01]))
SPHERES = np.array([[0.3, -0.4, 12.0], [2.0, 1.5, 9.0], [-1.0, 0.5, 5.0]])
AXES = np.array([[0.5, 0.8, 0.1], [1.0, 0.0, -0.2], [-0.3, 0.9, 0.3]])


def cylinders() -> tuple[np.ndarray, np.ndarray]:
    axes = AXES / np.linalg.norm(AXES, axis=1)[:, None]
    return SPHERES - axes * np.sum(SPHERES * axes, axis=1)[:, None], axes


def test_the_same_lens_changes_nothing() -> None:
    s, axes = cylinders()
    again, axes_again = through_other_lens(s, axes, LENS, LENS, SIZE)
    assert np.allclose(again, s, rtol=1e-9)
    assert axes_again is not None
    assert np.allclose(axes_again, axes, atol=1e-9)
    assert np.allclose(through_other_lens(SPHERES, None, LENS, LENS, SIZE)[0], SPHERES, rtol=1e-9)


def test_a_sphere_straight_ahead_goes_off_with_the_focal_length() -> None:
    lens, longer = Intrinsics(800.0, 800.0, 320.0, 240.0), Intrinsics(816.0, 816.0, 320.0, 240.0)
    s, _ = through_other_lens(np.array([[0.0, 0.0, 10.0]]), None, lens, longer, SIZE)
    tangent = np.tan(np.arcsin(0.1)) * 800.0 / 816.0
    assert s[0] == pytest.approx([0.0, 0.0, 1.0 / np.sin(np.arctan(tangent))])


@pytest.mark.parametrize("s", list(SPHERES))
def test_the_new_sphere_has_the_old_outline(s: np.ndarray) -> None:
    pixels = outline_px(Feature(s, np.eye(3)), LENS, SIZE[::-1])[0]
    moved = through_other_lens(s[None], None, LENS, OTHER, SIZE)[0][0]
    assert off_px(pixels, moved) < 0.1
    assert off_px(pixels, s) > 0.5


def off_px(pixels: np.ndarray, s: np.ndarray) -> float:
    """How far pixels, seen through the other lens, are from the outline of a sphere at s; rms."""
    rays = np.column_stack([OTHER.normalise(pixels), np.ones(len(pixels))])
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    inside = np.all((pixels > 0) & (pixels < SIZE), axis=1)
    angles = np.arccos(rays @ s / np.linalg.norm(s)) - np.arcsin(1.0 / np.linalg.norm(s))
    return float(800.0 * np.sqrt(np.mean(angles[inside] ** 2)))


def test_a_cylinder_moves_as_its_sides_do() -> None:
    s, axes = cylinders()
    moved, turned = through_other_lens(s, axes, LENS, OTHER, SIZE)
    assert turned is not None
    assert np.allclose(np.sum(moved * turned, axis=1), 0.0, atol=1e-9)
    for k in range(len(s)):
        for lines, feature in ((0.1, moved[k]), (1e3, s[k])):
            axis = turned[k] if lines < 1.0 else axes[k]
            n = (feature - np.cross(feature, axis) * np.sqrt(feature @ feature - 1.0)) / (
                feature @ feature
            )
            pixels = outline_px(Feature(s[k], np.eye(3), axes[k]), LENS, SIZE[::-1])[0]
            rays = np.column_stack([OTHER.normalise(pixels), np.ones(len(pixels))])
            off = 800.0 * np.sqrt(np.mean((rays @ n) ** 2))
            assert off < lines
            assert off > 0.5 or lines < 1.0


def test_a_target_out_of_view_stays_where_it_was() -> None:
    s = np.array([[0.5, 40.0, 1.0]])
    assert np.array_equal(through_other_lens(s, None, LENS, OTHER, SIZE)[0], s)
