"""Rigid motions obey their algebra; projections and their derivatives are exact."""

import numpy as np
import pytest

from rig.calibration import se3
from rig.calibration.projection import COUNT, from_vector, project, to_vector
from tests.rig.calibration.synthetic import random_truth, tool_poses


@pytest.mark.parametrize("size", [1e-9, 1e-5, 0.3, 3.1])
def test_the_logarithm_undoes_the_exponential(size: float) -> None:
    twists = size * np.random.default_rng(1).uniform(-0.55, 0.55, (50, 6))
    assert np.allclose(se3.log(se3.exp(twists)), twists, atol=1e-12 + 1e-9 * size)


def test_a_turn_about_an_axis_off_the_origin_carries_points_around_it() -> None:
    # ω about z through (1, 0, 0): v = −ω × p. Half a turn takes the origin to (2, 0, 0).
    T = se3.exp(np.array([0.0, -np.pi, 0.0, 0.0, 0.0, np.pi]))
    assert np.allclose(T[:3, 3], [2.0, 0.0, 0.0])


def test_the_adjoint_moves_a_twist_through_a_pose() -> None:
    rng = np.random.default_rng(2)
    T, twist = se3.exp(rng.normal(size=6)), 0.1 * rng.normal(size=6)
    assert np.allclose(T @ se3.exp(twist), se3.exp(se3.adjoint(T) @ twist) @ T)
    assert np.allclose(se3.inverse(T) @ T, np.eye(4))


def test_points_project_as_the_estimator_projects_them() -> None:
    truth = random_truth(3)
    for T_base_tool in tool_poses(truth, 5, 3):
        T = truth.camera_from_tool(T_base_tool)
        got = project(to_vector(truth.intrinsics), T[None], truth.points_m[None])
        assert np.allclose(got.pixels[0], truth.pixels(T_base_tool), atol=1e-9)


def test_every_derivative_agrees_with_finite_differences() -> None:
    truth = random_truth(4)
    values, points = to_vector(truth.intrinsics), truth.points_m[None]
    T = truth.camera_from_tool(tool_poses(truth, 1, 4)[0])[None]
    got, h = project(values, T, points), 1e-6
    for i in range(6):
        step = h * np.eye(6)[i]
        ahead = project(values, se3.exp(step)[None] @ T, points).pixels
        behind = project(values, se3.exp(-step)[None] @ T, points).pixels
        assert np.allclose(got.by_pose[..., i], (ahead - behind) / (2 * h), atol=1e-4)
    for i in range(COUNT):
        step = h * np.eye(COUNT)[i]
        ahead, behind = (project(values + s * step, T, points).pixels for s in (1, -1))
        assert np.allclose(got.by_intrinsics[..., i], (ahead - behind) / (2 * h), atol=1e-4)
    ahead, behind = (project(values, T, (1 + s * h) * points).pixels for s in (1, -1))
    assert np.allclose(got.by_scale, (ahead - behind) / (2 * h), atol=1e-4)


def test_the_vector_form_keeps_every_value() -> None:
    values = np.arange(1.0, 10.0)
    assert np.array_equal(to_vector(from_vector(values)), values)
