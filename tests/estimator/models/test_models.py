"""Interaction matrices, row by row, against finite differences of exact projection."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.image.feature import Feature
from estimator.models.bearings import Bearings
from estimator.models.cylinder import Cylinder
from estimator.models.model import Model
from estimator.models.points import Points
from estimator.models.sphere import Sphere
from tests.estimator.models.exact_projection import (
    cylinder_lines,
    cylinder_s_and_axis,
    orient,
    sphere_outline,
    sphere_s,
)

FloatArray = NDArray[np.float64]

SPHERES = [
    (np.array([0.03, -0.05, 0.3]), 0.019),
    (np.array([-0.08, 0.02, 0.25]), 0.042),
    (np.array([0.0, 0.0, 0.2]), 0.05),
]
PIPES = [
    (np.array([0.02, -0.03, 0.4]), np.array([0.35, 0.9, 0.2]), 0.042),
    (np.array([0.05, 0.04, 0.3]), np.array([0.9, -0.3, 0.4]), 0.03),
    (np.array([0.0, 0.0, 0.25]), np.array([0.6, 0.8, 0.0]), 0.02),
]
STEP = 1e-4
UNIT_TWISTS = list(np.eye(6))


def moved(point_m: FloatArray, u: FloatArray, step: float) -> FloatArray:
    """A fixed point in the frame of a camera that moved by the twist u for ``step``."""
    # The translation after half the turn: exact to second order in the step.
    half = Rotation.from_rotvec(-0.5 * step * u[3:])
    result: FloatArray = half.apply(half.apply(point_m) - step * u[:3])
    return result


def seen_sphere(centre_m: FloatArray, radius_m: float) -> FloatArray:
    return sphere_s(sphere_outline(centre_m, radius_m))


def seen_cylinder(point_m: FloatArray, axis: FloatArray, radius_m: float) -> FloatArray:
    """(s, a) (6,) from the two image lines."""
    n1, n2 = cylinder_lines(point_m, axis, radius_m)
    s, a = cylinder_s_and_axis(*orient(n1, n2, point_m))
    return np.concatenate((s, a * np.sign(a @ axis)))


def modelled_rate(model: Model, s: FloatArray, radius_m: float, u: FloatArray) -> FloatArray:
    chi = model.chi_of_guess(s, radius_m)
    rate: FloatArray = model.f_m(s, u) + model.Omega(s, u[:3]).T @ chi
    return rate


@pytest.mark.parametrize("u", UNIT_TWISTS)
@pytest.mark.parametrize(("centre_m", "radius_m"), SPHERES)
def test_sphere_moves_in_the_image_as_eq_12_says(
    centre_m: FloatArray, radius_m: float, u: FloatArray
) -> None:
    before, after = (seen_sphere(moved(centre_m, u, h), radius_m) for h in (-STEP, STEP))
    s = seen_sphere(centre_m, radius_m)
    np.testing.assert_allclose(s, centre_m / radius_m, rtol=1e-9, atol=1e-9)
    found = modelled_rate(Sphere(), s, radius_m, u)
    np.testing.assert_allclose(found, (after - before) / (2 * STEP), atol=2e-4)


@pytest.mark.parametrize("u", UNIT_TWISTS)
@pytest.mark.parametrize(("point_m", "direction", "radius_m"), PIPES)
def test_cylinder_moves_in_the_image_as_eq_20_and_30_say(
    point_m: FloatArray, direction: FloatArray, radius_m: float, u: FloatArray
) -> None:
    axis = direction / np.linalg.norm(direction)

    def seen(h: float) -> FloatArray:
        turned = Rotation.from_rotvec(-h * u[3:]).apply(axis)
        return seen_cylinder(moved(point_m, u, h), turned, radius_m)

    s = seen(0.0)
    P0 = point_m - axis * (axis @ point_m)
    np.testing.assert_allclose(s, np.concatenate((P0 / radius_m, axis)), atol=1e-12)
    found = modelled_rate(Cylinder(), s, radius_m, u)
    np.testing.assert_allclose(found, (seen(STEP) - seen(-STEP)) / (2 * STEP), atol=2e-4)


@pytest.mark.parametrize(("point_m", "direction", "radius_m"), PIPES)
def test_line_normals_of_eq_13_must_point_to_the_cylinder(
    point_m: FloatArray, direction: FloatArray, radius_m: float
) -> None:
    axis = direction / np.linalg.norm(direction)
    P0 = point_m - axis * (axis @ point_m)
    n1, n2 = orient(*cylinder_lines(point_m, axis, radius_m), P0)
    for n in (n1, n2):
        assert n @ P0 / np.linalg.norm(n) == pytest.approx(radius_m, rel=1e-12)
    wrong, _ = cylinder_s_and_axis(-n1, n2)
    assert np.linalg.norm(wrong - P0 / radius_m) > 0.5 * np.linalg.norm(P0 / radius_m)


def test_omega_of_the_sphere_has_the_sign_of_eq_12_not_the_printed_one() -> None:
    v = np.array([0.3, -0.2, 0.1])
    np.testing.assert_array_equal(Sphere().Omega(np.array([0.0, 0.0, 10.0]), v), [-v])


def test_a_cylinders_axis_is_read_with_the_sign_that_was_tracked() -> None:
    s, a = np.array([0.0, 1.0, 8.0]), np.array([1.0, 0.0, 0.0])
    model = Cylinder()
    kept = model.measured(Feature(s, np.eye(3), a), None)
    flipped = model.measured(Feature(s, np.eye(3), -a), kept)
    np.testing.assert_array_equal(flipped, kept)
    with pytest.raises(ValueError, match="axis"):
        model.measured(Feature(s, np.eye(3)), None)


@pytest.mark.parametrize("model", [Sphere(), Cylinder(), Points(2), Bearings(2)])
def test_the_compiled_terms_are_those_the_model_states(model: Model) -> None:
    rng = np.random.default_rng(3)
    m, h = model.m, 1e-6
    s, u = rng.standard_normal((4, m)), rng.standard_normal((4, 6))
    chi = rng.standard_normal((4, model.p))
    Omega = model.structures(s, u)
    assert Omega.shape == (4, model.p, m)
    for k in range(4):
        np.testing.assert_array_equal(Omega[k], model.Omega(s[k], u[k, :3]))
        steady = np.array([u[k], u[k]])
        s_after, chi_after = model.flow(s[k : k + 1], chi[k : k + 1], np.array([0.0, h]), steady)
        rate = model.f_m(s[k], u[k]) + Omega[k].T @ chi[k]
        np.testing.assert_allclose((s_after[0, 1] - s[k]) / h, rate, atol=1e-4)
        np.testing.assert_allclose(
            (chi_after[0, 1] - chi[k]) / h, model.f_u(s[k], chi[k], u[k]), atol=1e-4
        )
