"""(24): the norm is kept, σ1² climbs to its maximum, and v ∥ a is left behind."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.active.policy import ConstantVelocity, PaperPolicy
from estimator.active.sigma2 import J_a, J_v, sigma2

FloatArray = NDArray[np.float64]

AXIS = np.array([0.35, 0.9, 0.2]) / np.linalg.norm([0.35, 0.9, 0.2])
STILL = np.zeros(3)
DT_S = 0.01


def advanced(
    policy: PaperPolicy, duration_s: float, axis: FloatArray = AXIS, omega: FloatArray = STILL
) -> list[tuple[FloatArray, FloatArray]]:
    """(v, a) at every tick while the camera turns at ω."""
    turn = Rotation.from_rotvec(-DT_S * omega)
    rows = []
    for _ in range(round(duration_s / DT_S)):
        rows.append((policy.v, axis))
        policy.advance(axis, omega, DT_S)
        axis = turn.apply(axis)
    return rows


@pytest.mark.parametrize("v0", [(-0.01, 0.05, 0.05), (-0.05, 0.05, 0.01)])
def test_sigma2_climbs_to_the_square_of_the_norm_which_is_kept(
    v0: tuple[float, float, float],
) -> None:
    rows = advanced(PaperPolicy(v0, 10.0, 1.0), 8.0)
    squares = np.array([float(v @ v) for v, _ in rows])
    np.testing.assert_allclose(squares, np.dot(v0, v0), rtol=1e-6)
    useful = np.array([float(sigma2(v, a)) for v, a in rows])
    assert np.all(np.diff(useful) > -1e-15)
    assert useful[-1] == pytest.approx(squares[-1], rel=1e-6)


def test_v_dot_is_eq_24_as_printed_with_j_a_corrected() -> None:
    rng = np.random.default_rng(4)
    policy = PaperPolicy([0.0, 0.0, 0.07], 10.0, 1.3)
    for _ in range(20):
        v, omega = rng.standard_normal((2, 3)) * [[0.05], [0.3]]
        a = rng.standard_normal(3)
        a /= np.linalg.norm(a)
        row = J_v(v, a)[None, :]
        ascent = row.T @ [1.0] - np.linalg.pinv(row) @ [J_a(v, a) @ np.cross(a, omega)]
        expected = (
            v / (v @ v) * 10.0 * (0.5 * 0.07**2 - 0.5 * (v @ v))
            + 1.3 * (np.eye(3) - np.outer(v, v) / (v @ v)) @ ascent
        )
        np.testing.assert_allclose(policy.v_dot(v, a, omega), expected, rtol=1e-9, atol=1e-12)


def test_the_axis_turning_away_is_compensated() -> None:
    """With aᵀv = 0 reached, σ1² stays at its maximum only as v follows the axis."""
    v0 = 0.07 * np.cross(AXIS, [0.0, 0.0, 1.0])
    rows = advanced(PaperPolicy(v0, 10.0, 1.0), 5.0, omega=np.array([0.3, 0.2, 0.1]))
    for v, a in rows[300:]:
        assert sigma2(v, a) > 0.97 * float(v @ v)


def test_without_k2_only_the_norm_is_held() -> None:
    v0 = np.array([-0.01, 0.05, 0.05])
    policy = PaperPolicy(v0, 10.0, 0.0)
    advanced(policy, 3.0, omega=np.array([0.2, 0.1, 0.0]))
    np.testing.assert_allclose(policy.v, v0, rtol=1e-12)


def test_on_a_sphere_the_velocity_is_constant() -> None:
    v0 = np.array([0.0, 0.045, 0.02])
    policy = PaperPolicy(v0, 10.0, 1.0)
    for _ in range(300):
        policy.advance(None, np.array([0.1, 0.2, 0.0]), DT_S)
    np.testing.assert_allclose(policy.v, v0, rtol=1e-12)
    constant = ConstantVelocity(v0)
    constant.advance(None, np.array([0.1, 0.2, 0.0]), DT_S)
    np.testing.assert_array_equal(constant.v, v0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("axis", [AXIS, np.eye(3)[0], np.eye(3)[1], np.eye(3)[2]])
def test_along_the_axis_it_finds_its_way_out_always_the_same_way(
    axis: FloatArray, sign: float
) -> None:
    first, second = (PaperPolicy(sign * 0.07 * axis, 10.0, 1.0) for _ in range(2))
    advanced(first, 1.0, axis)
    advanced(second, 1.0, axis)
    np.testing.assert_array_equal(first.v, second.v)
    v, _ = advanced(first, 5.0, axis)[-1]
    assert sigma2(v, axis) > 0.99 * 0.07**2
    assert np.linalg.norm(v) == pytest.approx(0.07, rel=1e-6)


@given(
    angle=st.floats(0.0, 0.1), around=st.floats(0.0, 6.3),
    omega=st.tuples(*(3 * [st.floats(-1.0, 1.0)])),
)  # fmt: skip
@settings(max_examples=200, deadline=None, derandomize=True)
def test_v_dot_is_bounded_however_near_v_is_to_the_axis(
    angle: float, around: float, omega: tuple[float, float, float]
) -> None:
    x, y, z = np.eye(3)
    v = 0.07 * (np.cos(angle) * z + np.sin(angle) * (np.cos(around) * x + np.sin(around) * y))
    rate = PaperPolicy([0.07, 0.0, 0.0], 10.0, 1.0).v_dot(v, z, np.array(omega))
    bound = 0.07 * (2.0 * 0.11 + np.linalg.norm(omega))
    assert np.linalg.norm(rate) <= bound * (1.0 + 1e-9)


def test_a_wrong_norm_is_corrected_at_the_rate_k1() -> None:
    policy = PaperPolicy([0.05, 0.0, 0.0], 10.0, 1.0)
    v = np.array([0.0, 0.02, 0.0])
    kappa_rate = v @ policy.v_dot(v, AXIS, STILL)
    assert kappa_rate == pytest.approx(10.0 * (0.5 * 0.05**2 - 0.5 * 0.02**2))


def test_large_gains_and_long_ticks_stay_stable() -> None:
    policy = PaperPolicy([0.0, 0.05, 0.05], 400.0, 50.0)
    for _ in range(15):
        policy.advance(AXIS, np.array([0.5, 0.0, 0.0]), 0.1)
        assert np.linalg.norm(policy.v) == pytest.approx(np.hypot(0.05, 0.05), rel=1e-3)


def test_what_the_policy_hands_out_is_a_copy() -> None:
    policy = PaperPolicy([0.05, 0.0, 0.0], 10.0, 1.0)
    policy.v[0] = 9.0
    assert policy.v[0] == 0.05


def test_nonsense_is_refused() -> None:
    with pytest.raises(ValueError, match="not zero"):
        PaperPolicy([0.0, 0.0, 0.0], 10.0, 1.0)
    with pytest.raises(ValueError, match="negative"):
        PaperPolicy([0.1, 0.0, 0.0], -1.0, 1.0)
    with pytest.raises(ValueError, match="three finite numbers"):
        ConstantVelocity([0.1, 0.0])
