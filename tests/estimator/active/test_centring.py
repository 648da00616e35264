"""ω takes s_x and s_y to zero at the gain asked for, whatever v does meanwhile."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimator.active.centring import centring_omega
from estimator.active.controller import Controller
from estimator.active.policy import ConstantVelocity
from estimator.estimate import Estimate
from estimator.models.cylinder import Cylinder
from estimator.models.sphere import Sphere

FloatArray = NDArray[np.float64]

AXIS = np.array([0.6, 0.75, 0.25]) / np.linalg.norm([0.6, 0.75, 0.25])
S = np.array([1.5, -2.0, 11.0])
S_CYLINDER = S - AXIS * (AXIS @ S)
V = np.array([-0.05, 0.03, 0.02])
CHI = 1.0 / 0.042


def test_on_a_sphere_the_offsets_decay_at_the_gain() -> None:
    omega = centring_omega(S, None, CHI, V, 4.0)
    u = np.concatenate((V, omega))
    rate = Sphere().f_m(S, u) + Sphere().Omega(S, V).T @ [CHI]
    np.testing.assert_allclose(rate[:2], -4.0 * S[:2], atol=1e-12)
    assert omega[2] == 0.0


def test_on_a_cylinder_the_axis_point_nearest_the_camera_is_centred() -> None:
    state = np.concatenate((S_CYLINDER, AXIS))
    omega = centring_omega(S_CYLINDER, AXIS, CHI, V, 4.0)
    u = np.concatenate((V, omega))
    rate = Cylinder().f_m(state, u) + Cylinder().Omega(state, V).T @ [CHI]
    np.testing.assert_allclose(rate[:2], -4.0 * S_CYLINDER[:2], atol=1e-12)
    assert omega[2] == 0.0


@given(s=st.tuples(*(3 * [st.floats(-20.0, 20.0)])), chi=st.floats(-100.0, 100.0))
@hypothesis_settings(max_examples=100, deadline=None, derandomize=True)
def test_it_is_bounded_wherever_the_target_is(s: tuple[float, float, float], chi: float) -> None:
    omega = centring_omega(np.array(s), None, chi, V, 5.0)
    bound = 5.0 * np.hypot(s[0], s[1]) + abs(chi) * np.linalg.norm(V)
    assert np.linalg.norm(omega) <= bound * (1.0 + 1e-12)


def estimate(s: FloatArray, axis: FloatArray | None = None) -> Estimate:
    return Estimate(0.0, s, axis, CHI, None, 0.0)


def test_the_twist_is_the_policys_velocity_and_the_centring_omega() -> None:
    controller = Controller(ConstantVelocity(V), 2.0)
    u = controller.twist(estimate(S_CYLINDER, AXIS), 0.01)
    np.testing.assert_array_equal(u[:3], V)
    np.testing.assert_array_equal(u[3:], centring_omega(S_CYLINDER, AXIS, CHI, V, 2.0))


def test_far_off_centre_the_turning_rate_is_bounded_its_direction_kept() -> None:
    far = np.array([9.0, 3.0, 2.0])
    free = centring_omega(far, None, CHI, V, 5.0)
    u = Controller(ConstantVelocity(V), 5.0, max_omega_rad_s=0.5).twist(estimate(far), 0.01)
    np.testing.assert_allclose(u[3:], 0.5 * free / np.linalg.norm(free))


@pytest.mark.parametrize(("gain", "bound"), [(0.0, 1.0), (5.0, 0.0)])
def test_gain_and_bound_must_be_positive(gain: float, bound: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        Controller(ConstantVelocity(V), gain, bound)
