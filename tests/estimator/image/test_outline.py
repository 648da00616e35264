"""Outlines for drawing."""

import numpy as np
import pytest

from estimator.image.feature import Feature
from estimator.image.intrinsics import Intrinsics
from estimator.image.outline import outline_px
from tests.estimator.image.exact_images import DEFAULT_INTRINSICS, cylinder_s

LENS = Intrinsics(800.0, 800.0, 319.5, 239.5, np.array([-0.25, 0.05, 0.0, 0.0, 0.0]))
SHAPE = (480, 640)


@pytest.mark.parametrize("intrinsics", [DEFAULT_INTRINSICS, LENS])
def test_a_sphere_is_one_closed_curve_on_its_cone(intrinsics: Intrinsics) -> None:
    s = np.array([2.0, 1.0, 11.0])
    (curve,) = outline_px(Feature(s, np.eye(3)), intrinsics, SHAPE)
    assert np.array_equal(curve[0], curve[-1])
    p = np.concatenate([intrinsics.normalise(curve), np.ones((len(curve), 1))], axis=1)
    assert np.allclose((p @ s) ** 2, (s @ s - 1.0) * np.sum(p * p, axis=1), rtol=1e-9)


@pytest.mark.parametrize("intrinsics", [DEFAULT_INTRINSICS, LENS])
def test_a_cylinder_is_two_lines_from_border_to_border(intrinsics: Intrinsics) -> None:
    axis = np.array([0.2, 1.0, 0.1]) / np.linalg.norm([0.2, 1.0, 0.1])
    s = cylinder_s(np.array([0.3, 0.0, 9.0]), axis)
    lines = outline_px(Feature(s, np.eye(3), axis), intrinsics, SHAPE)
    assert len(lines) == 2
    for line in lines:
        assert line[:, 0].min() >= 0 and line[:, 0].max() <= 639
        assert line[:, 1].min() < 3.0 and line[:, 1].max() > 476.0
        p = np.concatenate([intrinsics.normalise(line), np.ones((len(line), 1))], axis=1)
        across = np.sum(p * p, axis=1) - (p @ axis) ** 2
        assert np.allclose((p @ s) ** 2, (s @ s - 1.0) * across, rtol=1e-7)


def test_a_side_out_of_view_is_left_out() -> None:
    axis = np.array([0.0, 1.0, 0.0])
    s = np.array([-3.5, 0.0, 8.0])
    assert len(outline_px(Feature(s, np.eye(3), axis), DEFAULT_INTRINSICS, SHAPE)) == 1


def test_a_camera_inside_the_target_is_an_error() -> None:
    with pytest.raises(ValueError, match="inside the target"):
        outline_px(Feature(np.array([0.0, 0.0, 0.9]), np.eye(3)), DEFAULT_INTRINSICS, SHAPE)
