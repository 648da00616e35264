"""The jog on simulated time: any arm, limits kept, what is measured is what happened."""

import numpy as np
import pytest

from drivers.errors import ConfigError, DeviceTimeoutError, SafetyError
from rig.config_safety import SafetyConfig
from rig.jog import jog
from sim_backend.clock import SimulatedClock
from sim_backend.config import SimConfig
from sim_backend.rig import SimulatedRig
from tests.rig.fakes import ArmBroke, KinematicArm

TWIST = np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.2])
LIMITS = SafetyConfig()


def never():
    return False


def fake():
    clock = SimulatedClock()
    return KinematicArm(clock), clock


def test_the_simulated_gantry_does_what_the_report_says():
    clock = SimulatedClock()
    arm = SimulatedRig(SimConfig(), "sphere", clock).arm
    result = jog(arm, clock, TWIST, False, 1.0, LIMITS, never)
    assert np.allclose(result.allowed, TWIST)
    assert np.allclose(result.measured, TWIST, atol=1e-3)
    assert 0.0 < result.latency_s < 0.05
    assert 0.0 < result.stop_s < 0.3
    assert result.moved_m == pytest.approx(0.05, abs=0.01)
    assert result.state_rate_hz == pytest.approx(500.0, rel=0.01)
    assert not result.interrupted


def test_a_twist_in_base_axes_keeps_its_direction_while_the_tool_turns():
    arm, clock = fake()
    twist = np.array([0.0, 0.05, 0.0, 0.0, 0.0, 1.0])
    result = jog(arm, clock, twist, True, 1.0, LIMITS, never)
    assert np.allclose(result.measured, twist, atol=2e-3)
    moved = arm.history[-1].T_base_tool[:3, 3] - arm.history[0].T_base_tool[:3, 3]
    assert abs(moved[0]) < 2e-3 and moved[1] > 0.04


def test_limits_cut_the_twist_and_are_named():
    arm, clock = fake()
    result = jog(arm, clock, TWIST * 10, False, 1.0, LIMITS, never)
    assert np.linalg.norm(result.allowed[:3]) <= LIMITS.max_linear_speed_m_s + 1e-9
    assert {"linear speed", "linear acceleration"} <= set(result.limited_by)


def test_the_workspace_ends_the_motion():
    arm, clock = fake()
    down = np.array([0.0, 0.0, 0.15, 0.0, 0.0, 0.0])  # the tool looks down
    jog(arm, clock, down, False, 8.0, LIMITS, never)
    assert arm.history[-1].T_base_tool[2, 3] > LIMITS.workspace_min_m[2] - 0.01


def test_an_interruption_stops_at_the_next_tick():
    arm, clock = fake()
    result = jog(arm, clock, TWIST, False, 5.0, LIMITS, lambda: clock.now_s() > 0.5)
    assert result.interrupted
    assert clock.now_s() < 1.0
    assert arm.stops >= 1


@pytest.mark.parametrize("bad", [np.zeros(6), np.full(6, np.nan), np.zeros(5)])
def test_what_is_no_motion_is_refused(bad):
    arm, clock = fake()
    with pytest.raises(ConfigError, match="six finite numbers"):
        jog(arm, clock, bad, False, 1.0, LIMITS, never)
    assert arm.commands == []


def test_a_failing_arm_is_told_to_stop_and_its_error_comes_through():
    arm, clock = fake()
    arm.fail_at_s = 0.6
    with pytest.raises(ArmBroke):
        jog(arm, clock, TWIST, False, 2.0, LIMITS, never)
    assert arm.stops >= 1


def test_an_arm_that_goes_silent_is_a_safety_stop():
    arm, clock = fake()
    arm.silent_from_s = 0.6
    with pytest.raises(SafetyError, match="old"):
        jog(arm, clock, TWIST, False, 2.0, LIMITS, never)
    assert arm.stops >= 1


def test_an_arm_that_never_says_anything_is_a_timeout():
    arm, clock = fake()
    arm.silent_from_s = -1.0
    with pytest.raises(DeviceTimeoutError, match="no state"):
        jog(arm, clock, TWIST, False, 2.0, LIMITS, never)
