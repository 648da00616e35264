"""The jog on simulated time: any arm, limits kept, what is measured is what happened."""

import numpy as np
import pytest

from drivers.errors import ConfigError, DeviceTimeoutError, SafetyError
from rig.config_safety import SafetyConfig, TableConfig
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


class HeldUpArm(KinematicArm):
    """An arm in a program that is held up for a while during one reading."""

    def __init__(self, clock: SimulatedClock, at_s: float, for_s: float) -> None:
        super().__init__(clock)
        self.held = (at_s, for_s)

    def read_states(self):
        at_s, for_s = self.held
        if self.clock.now_s() >= at_s:
            self.held = (np.inf, 0.0)
            self.clock.sleep_until(self.clock.now_s() + for_s)
        return super().read_states()


def test_a_short_hang_makes_the_motion_ramp_up_again():
    clock = SimulatedClock()
    arm = HeldUpArm(clock, 0.8, 0.2)
    jog(arm, clock, TWIST, False, 2.0, LIMITS, never)
    after = [twist for t, twist in arm.commands if t >= 0.95]
    assert not np.any(after[0])  # decided before the hang
    speeds = [np.linalg.norm(twist[:3]) for twist in after]
    assert max(np.diff(speeds)) <= 3 * LIMITS.max_linear_acceleration_m_s2 * 0.01 * (1 + 1e-6)


def test_a_long_hang_ends_the_jog():
    clock = SimulatedClock()
    arm = HeldUpArm(clock, 0.8, 2.0)
    with pytest.raises(SafetyError, match="held up"):
        jog(arm, clock, TWIST, False, 5.0, LIMITS, never)
    assert all(not np.any(twist) for t, twist in arm.commands if t > 0.85)
    assert arm.stops >= 1


def test_the_camera_keeps_off_the_table_where_its_place_is_known():
    arm, clock = fake()
    tool_m = arm.pose_at(0.0)[2, 3]
    table = TableConfig(offset_m=tool_m - 0.2, min_distance_m=0.02)
    safety = LIMITS.model_copy(update={"table": table})
    camera = np.eye(4)
    camera[2, 3] = 0.12  # the tool looks down
    down = np.array([0.0, 0.0, 0.05, 0.0, 0.0, 0.0])
    result = jog(arm, clock, down, False, 4.0, safety, never, camera)
    assert arm.history[-1].T_base_tool[2, 3] - 0.12 > tool_m - 0.2 + 0.015
    assert any("table (camera)" in reason for reason in result.limited_by)


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
