"""The simulated arm: it follows, lags, obeys limits, and stops by itself."""

import numpy as np
import pytest

from drivers.errors import OperateError
from sim_backend.kinematics import JOINT_HIGH
from tests.sim_backend.helpers import built, fit_first_order_lag

EXACT = {
    "encoder_step_m": 0.0,
    "encoder_step_rad": 0.0,
    "noise_m_s": 0.0,
    "noise_rad_s": 0.0,
}
TWIST = np.array([0.04, -0.03, 0.02, 0.10, -0.15, 0.05])


def follow(rig, clock, twist, seconds, hold_s=0.05):
    """Command ``twist`` every 10 ms and return all states."""
    states = []
    end_s = clock.now_s() + seconds
    while clock.now_s() < end_s - 1e-9:
        rig.arm.command_twist(twist, hold_s)
        clock.sleep_until(clock.now_s() + 0.01)
        states += rig.arm.read_states()
    return states


def test_without_a_command_nothing_moves():
    rig, clock = built("sphere", arm=EXACT)
    before = rig.truth.T_base_camera(0.0)
    clock.sleep_until(2.0)
    # A second of gravity would show: this is the compensation's rounding.
    np.testing.assert_allclose(rig.truth.T_base_camera(2.0), before, atol=1e-9)
    assert max(np.abs(s.twist_tool).max() for s in rig.arm.read_states()) < 1e-8


def test_it_settles_on_the_commanded_twist():
    rig, clock = built("sphere", arm=EXACT)
    states = follow(rig, clock, TWIST, 0.5)
    np.testing.assert_allclose(states[-1].twist_tool, TWIST, rtol=0.02, atol=2e-4)


def test_the_twist_is_held_in_the_tool_frame():
    rig, clock = built("sphere", arm=EXACT)
    twist = np.array([0.05, 0.0, 0.0, 0.0, 0.5, 0.0])
    rig.arm.command_twist(twist, 1.0)  # one command for half a radian of turning
    clock.sleep_until(1.0)
    states = [s for s in rig.arm.read_states() if s.t_s > 0.3]
    for state in states:
        np.testing.assert_allclose(state.twist_tool, twist, atol=0.02 * 0.5)


@pytest.mark.parametrize("lag_s", [0.015, 0.025])
def test_the_drives_lag_by_the_configured_time_constant(lag_s):
    rig, clock = built("sphere", arm={**EXACT, "slide_lag_s": lag_s})
    # Small enough that the acceleration limit is out of play after a millisecond.
    states = follow(rig, clock, np.array([0.002, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.3)
    t = np.array([s.t_s for s in states])
    share = np.array([s.twist_tool[0] for s in states]) / 0.002
    assert fit_first_order_lag(t, share) == pytest.approx(lag_s, rel=0.1)


def test_it_stops_by_itself_when_commands_cease():
    rig, clock = built("sphere", arm=EXACT)
    follow(rig, clock, TWIST, 0.3, hold_s=0.05)
    last_command_s = clock.now_s() - 0.01
    clock.sleep_until(last_command_s + 0.6)
    states = rig.arm.read_states()
    held = [s for s in states if s.t_s < last_command_s + 0.05]
    stopped = [s for s in states if s.t_s > last_command_s + 0.05 + 0.25]
    assert held
    assert min(np.linalg.norm(s.twist_tool[:3]) for s in held) > 0.9 * np.linalg.norm(TWIST[:3])
    assert max(np.abs(s.twist_tool).max() for s in stopped) < 1e-4


def test_stop_ramps_to_standstill_within_the_acceleration_limits():
    rig, clock = built("sphere", arm=EXACT)
    follow(rig, clock, np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.4, hold_s=10.0)
    rig.arm.stop()
    clock.sleep_until(clock.now_s() + 0.4)
    assert np.abs(rig.arm.read_states()[-1].twist_tool).max() < 1e-4
    instants = np.arange(0.401, 0.799, 0.001)
    slides = np.array([rig._world.history.at(t)[1][:3] for t in instants])
    hardest = np.abs(np.diff(slides, axis=0) / 0.001).max()
    assert 0.8 * 2.0 < hardest < 1.02 * 2.0


def test_speeds_are_limited_without_bending_the_direction():
    rig, clock = built("sphere", arm=EXACT)
    twist = np.array([2.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    v = follow(rig, clock, twist, 0.6)[-1].twist_tool[:3]
    rates = rig._world.history.at(clock.now_s())[1]
    assert np.abs(rates[:3]).max() == pytest.approx(0.5, rel=0.02)
    np.testing.assert_allclose(v / np.linalg.norm(v), twist[:3] / np.linalg.norm(twist), atol=0.02)


def test_a_quarter_metre_per_second_and_one_and_a_half_radians_are_allowed():
    rig, clock = built("sphere", arm=EXACT)
    twist = np.array([0.0, 0.0, -0.25, 0.0, 0.0, 1.5])
    np.testing.assert_allclose(
        follow(rig, clock, twist, 0.8)[-1].twist_tool, twist, rtol=0.03, atol=0.02
    )


def test_a_joint_at_its_limit_stops_there():
    rig, clock = built("sphere", arm=EXACT)
    away = np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
    follow(rig, clock, away, 6.0)
    q, qd = rig._world.history.at(clock.now_s())
    reached = q[:3] > JOINT_HIGH[:3] - 0.005
    assert reached.any()
    assert np.all(q <= JOINT_HIGH + 1e-3)
    assert np.all(np.abs(qd[:3][reached]) < 1e-2)


@pytest.mark.parametrize(
    ("twist", "hold_s"),
    [
        ([np.nan, 0, 0, 0, 0, 0], 0.05),
        ([0, 0, 0, 0, np.inf, 0], 0.05),
        ([0, 0, 0], 0.05),
        ([0, 0, 0, 0, 0, 0], np.nan),
        ([0, 0, 0, 0, 0, 0], np.inf),
        ([0, 0, 0, 0, 0, 0], -1.0),
    ],
)
def test_a_nonsense_command_is_refused_and_stops_the_arm(twist, hold_s):
    rig, clock = built("sphere", arm=EXACT)
    follow(rig, clock, TWIST, 0.3, hold_s=10.0)
    with pytest.raises(OperateError, match="refused"):
        rig.arm.command_twist(np.array(twist, dtype=float), hold_s)
    clock.sleep_until(clock.now_s() + 0.5)
    assert np.abs(rig.arm.read_states()[-1].twist_tool).max() < 1e-3


def test_states_come_at_500_hz_in_order_and_with_the_reporting_delay():
    rig, clock = built("sphere", arm={"report_delay_s": 0.0055})
    times = []
    for k in range(1, 300):
        clock.sleep_until(k * 0.0037)
        fresh = [s.t_s for s in rig.arm.read_states()]
        assert not fresh or clock.now_s() - 0.0075 < fresh[-1] <= clock.now_s() - 0.0055 + 1e-9
        times += fresh
    np.testing.assert_allclose(np.diff(times), 0.002, atol=1e-9)
    assert rig.arm.read_states() == []


def test_measured_states_differ_from_the_truth_by_unbiased_noise_of_the_configured_size():
    rig, clock = built("sphere", arm={"noise_m_s": 2e-4, "noise_rad_s": 5e-4})
    clock.sleep_until(8.0)
    twists = np.array([s.twist_tool for s in rig.arm.read_states()])
    w = twists[:, 3:]
    assert w.std(axis=0)[2] == pytest.approx(5e-4, rel=0.15)
    np.testing.assert_allclose(twists.mean(axis=0), 0.0, atol=4 * 5e-4 / np.sqrt(len(twists)))


def test_twists_are_as_uncertain_and_as_correlated_as_stated():
    rig, clock = built("sphere")
    follow(rig, clock, TWIST, 0.5)  # the wrist has turned since the first sample
    clock.sleep_until(1.0)
    rig.arm.read_states()
    clock.sleep_until(41.0)
    states = rig.arm.read_states()
    stated, twists = states[-1].twist_covariance, np.array([s.twist_tool for s in states])
    np.testing.assert_allclose(stated, states[0].twist_covariance)
    seen = np.linalg.solve(np.linalg.cholesky(stated), twists.T)
    np.testing.assert_allclose(np.cov(seen), np.eye(6), atol=0.05)
    std = np.sqrt(np.diag(stated))
    assert abs(stated / np.outer(std, std) - np.eye(6)).max() > 0.1


def test_measured_poses_are_quantised_by_the_encoders_and_no_further_off():
    rig, clock = built("sphere")
    states = follow(rig, clock, TWIST, 0.4)
    T_tool_camera = rig.T_tool_camera
    for state in states[::10]:
        true = rig.truth.T_base_camera(state.t_s) @ np.linalg.inv(T_tool_camera)
        assert 0.0 < np.abs(state.T_base_tool - true).max() < 3e-5


def test_measured_twists_integrate_to_the_measured_motion():
    rig, clock = built("sphere", arm=EXACT)
    states = follow(rig, clock, TWIST, 1.0)
    moved = states[-1].T_base_tool[:3, 3] - states[0].T_base_tool[:3, 3]
    v_base = np.array([s.T_base_tool[:3, :3] @ s.twist_tool[:3] for s in states])
    integral = np.trapezoid(v_base, dx=0.002, axis=0)
    np.testing.assert_allclose(integral, moved, atol=2e-7)


def test_after_close_commands_are_refused_and_close_can_be_repeated():
    rig, _ = built("sphere")
    rig.arm.close()
    rig.arm.close()
    with pytest.raises(OperateError, match="after close"):
        rig.arm.command_twist(TWIST, 0.05)
