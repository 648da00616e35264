"""σ1² and its Jacobians against the model's Ω and finite differences."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.active.sigma2 import J_a, J_v, sigma2
from estimator.models.cylinder import Cylinder
from estimator.models.sphere import Sphere

FloatArray = NDArray[np.float64]
RNG = np.random.default_rng(9)
CASES = [(v, a / np.linalg.norm(a), omega) for v, a, omega in RNG.standard_normal((8, 3, 3))]
STEP = 1e-6


@pytest.mark.parametrize(("v", "a", "omega"), CASES)
def test_sigma2_is_the_eigenvalue_of_omega_omega_t(
    v: FloatArray, a: FloatArray, omega: FloatArray
) -> None:
    Omega = Cylinder().Omega(np.concatenate((omega, a)), v)
    assert sigma2(v, a) == pytest.approx((Omega @ Omega.T).item(), rel=1e-12)
    assert sigma2(v, a) == pytest.approx(v @ v - (a @ v) ** 2, rel=1e-12)  # (21)
    Omega = Sphere().Omega(omega, v)
    assert sigma2(v, None) == pytest.approx((Omega @ Omega.T).item(), rel=1e-12)


@pytest.mark.parametrize(("v", "a", "omega"), CASES)
def test_j_v_is_the_gradient_in_v(v: FloatArray, a: FloatArray, omega: FloatArray) -> None:
    for axis in (a, None):
        slopes = [
            (sigma2(v + e, axis) - sigma2(v - e, axis)) / (2 * STEP) for e in STEP * np.eye(3)
        ]
        np.testing.assert_allclose(J_v(v, axis), slopes, atol=1e-8)


@pytest.mark.parametrize(("v", "a", "omega"), CASES)
def test_j_a_is_the_rate_as_the_axis_turns_with_the_sign_of_errata(
    v: FloatArray, a: FloatArray, omega: FloatArray
) -> None:
    turned = [sigma2(v, a + h * np.cross(a, omega)) for h in (-STEP, STEP)]
    numeric = (turned[1] - turned[0]) / (2 * STEP)
    assert J_a(v, a) @ np.cross(a, omega) == pytest.approx(numeric, abs=1e-8)


@pytest.mark.parametrize(("v", "a", "omega"), CASES)
def test_eq_22_both_jacobians_together(v: FloatArray, a: FloatArray, omega: FloatArray) -> None:
    v_dot = np.array([0.3, -0.2, 0.5])
    after, before = (sigma2(v + h * v_dot, a + h * np.cross(a, omega)) for h in (STEP, -STEP))
    found = J_v(v, a) @ v_dot + J_a(v, a) @ np.cross(a, omega)
    assert found == pytest.approx((after - before) / (2 * STEP), abs=1e-8)


def test_the_axis_means_nothing_to_a_sphere() -> None:
    np.testing.assert_array_equal(J_a(np.array([1.0, 2.0, 3.0]), None), np.zeros(3))


def test_series_of_velocities_and_axes_go_in_one_call() -> None:
    v = np.array([row[0] for row in CASES])
    a = np.array([row[1] for row in CASES])
    np.testing.assert_allclose(sigma2(v, a), [sigma2(*row[:2]) for row in CASES])
    np.testing.assert_allclose(sigma2(v, None), (v**2).sum(axis=1))
