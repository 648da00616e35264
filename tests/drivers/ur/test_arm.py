"""The arm through the real vendor package, measured at the controller it talks to."""

import math

import numpy as np
import pytest

from drivers.clock import WallClock
from drivers.errors import ConnectError, DeviceTimeoutError, OperateError
from drivers.ur.arm import UrArm
from drivers.ur.faults import (
    ArmConnectionError,
    ArmProcessError,
    ArmStalledError,
    EmergencyStopError,
    ProgramStoppedError,
    ProtectiveStopError,
)
from drivers.ur.settings import UrSettings
from sim_backend.loopback_ur.kinematics import pose_and_jacobian, transform
from tests.drivers.ur.loopback import HOLD_S, drive, last_motion_s

TWIST = np.array([0.04, 0.0, 0.02, 0.0, 0.0, 0.1])
CLOCK = WallClock()


def test_states_come_once_in_order_and_on_the_hosts_clock(arm):
    start_s = CLOCK.now_s()
    arm.read_states()
    states = []
    while CLOCK.now_s() < start_s + 1.0:
        states += arm.read_states()
        CLOCK.sleep_until(CLOCK.now_s() + 0.01)
    times = np.array([state.t_s for state in states])
    assert len(states) > 400
    assert np.all(np.diff(times) > 0.0)
    # True every 2 ms: a host that is late receives them late, but does not stamp them late.
    assert abs(np.median(np.diff(times)) - 0.002) < 1e-4
    assert start_s - 0.2 < times[0] and times[-1] <= CLOCK.now_s()


def test_the_tool_moves_as_commanded_in_its_own_axes(arm, loopback):
    start_s = CLOCK.now_s()
    assert drive(arm, TWIST, 0.8) is None
    states = arm.read_states()
    assert np.allclose(states[-1].twist_tool, TWIST, atol=[1e-3] * 3 + [3e-3] * 3)
    # The truth: the flange's twist in its own axes, at a measured instant and pose.
    rows = loopback.control.motion(start_s)
    row = rows[np.argmin(np.abs(rows[:, 0] - states[-1].t_s))]
    T, J = pose_and_jacobian(row[1:7], np.eye(4))
    twist_base = J @ row[7:]
    assert np.linalg.norm(T[:3, :3].T @ twist_base[:3] - TWIST[:3]) < 0.01 * np.linalg.norm(
        TWIST[:3]
    )
    assert np.abs(T - states[-1].T_base_tool).max() < 3e-4


def test_the_arm_stops_by_itself_when_commands_end(arm, loopback):
    start_s = CLOCK.now_s()
    drive(arm, TWIST, 0.3)
    last_command_s = CLOCK.now_s()
    CLOCK.sleep_until(last_command_s + 0.5)
    assert arm.read_states()
    stopped_s = last_motion_s(loopback, start_s)
    assert last_command_s < stopped_s < last_command_s + HOLD_S + 0.3


def test_stop_brakes_and_can_be_repeated(arm, loopback):
    start_s = CLOCK.now_s()
    drive(arm, TWIST, 0.3)
    asked_s = CLOCK.now_s()
    arm.stop()
    arm.stop()
    CLOCK.sleep_until(asked_s + 0.4)
    assert last_motion_s(loopback, start_s) - asked_s < 0.25
    assert drive(arm, -TWIST, 0.1) is None  # and moves again when told to


@pytest.mark.parametrize("bad", [np.zeros(5), np.full(6, np.nan), np.full(6, np.inf)])
def test_what_is_no_twist_is_refused(arm, bad):
    with pytest.raises(OperateError, match="six finite numbers"):
        arm.command_twist(bad, 0.1)
    with pytest.raises(OperateError, match="finite hold time"):
        arm.command_twist(np.zeros(6), math.inf)


@pytest.mark.parametrize(
    ("fault", "kind", "stop_s"),
    [
        ("protective_stop", ProtectiveStopError, 0.25),
        ("program_stop", ProgramStoppedError, 0.25),
        ("drop", ArmConnectionError, 0.6),
        ("stall", ArmStalledError, 0.6),
    ],
)
def test_a_fault_is_a_typed_error_and_the_arm_stands(arm, loopback, fault, kind, stop_s):
    start_s = CLOCK.now_s()
    assert drive(arm, TWIST, 0.3) is None
    ordered_s = CLOCK.now_s()
    loopback.control.fault(fault, for_s=0.9 if fault == "stall" else 0.0)
    error = drive(arm, TWIST, 2.0)
    seen_s = CLOCK.now_s() - ordered_s
    print(f"{fault}: seen after {1e3 * seen_s:.0f} ms")
    # A child that dies of the vendor's crash before it can report is the same loss.
    assert isinstance(error, (kind, ArmProcessError) if fault == "drop" else kind)
    assert loopback.host in str(error)
    assert seen_s < 0.6
    with pytest.raises(type(error)):
        arm.read_states()  # it stays until recovered
    CLOCK.sleep_until(ordered_s + 1.1)
    assert last_motion_s(loopback, start_s) - ordered_s < stop_s


def test_an_emergency_stop_needs_a_person_and_then_recovers_without_moving(arm, loopback):
    assert drive(arm, TWIST, 0.3) is None
    loopback.control.fault("emergency_stop")
    assert isinstance(drive(arm, TWIST, 2.0), EmergencyStopError)
    with pytest.raises(OperateError, match="release it when it is safe"):
        arm.recover(lambda explanation: True)
    CLOCK.sleep_until(CLOCK.now_s() + 0.3)
    loopback.control.clear()
    explained = []
    arm.recover(lambda text: bool(explained.append(text)) or True)
    assert "power off" in explained[0]
    recovered_s = CLOCK.now_s()
    assert drive(arm, np.zeros(6), 0.2) is None
    assert last_motion_s(loopback, recovered_s) == recovered_s
    assert drive(arm, TWIST, 0.2) is None


def test_a_declined_recovery_unlocks_nothing(arm, loopback, settings):
    loopback.control.fault("protective_stop")
    assert isinstance(drive(arm, TWIST, 2.0), ProtectiveStopError)
    with pytest.raises(OperateError, match="nothing was unlocked"):
        arm.recover(lambda explanation: False)
    with pytest.raises(ConnectError, match="protective stop"):
        UrArm(settings, CLOCK)
    arm.recover(lambda explanation: True)
    assert drive(arm, TWIST, 0.1) is None


def test_settings_may_carry_keys_of_the_rig(loopback, arm):
    class RigSection(UrSettings):
        hold_s: float = 0.05

    arm.close()
    UrArm(RigSection(host=loopback.host), CLOCK).close()


def test_a_pinned_tcp_must_be_the_controllers(loopback, arm):
    assert np.allclose(arm.tcp_offset, 0.0, atol=1e-12)
    arm.close()
    pinned = UrSettings(host=loopback.host, tcp_offset=(0.0, 0.0, 0.12, 0.0, 0.0, 0.0))
    with pytest.raises(ConnectError, match=r"0\.12000.*calibrate again"):
        UrArm(pinned, CLOCK)


def test_the_tcp_digest_depends_on_the_tcp_and_nothing_else(arm):
    digest = arm.tcp_hash
    arm.tcp_offset = tuple(x + 1e-9 for x in arm.tcp_offset)
    assert arm.tcp_hash == digest
    arm.tcp_offset = (0.001, *arm.tcp_offset[1:])
    assert arm.tcp_hash != digest


def test_after_close_the_arm_is_refused_and_its_program_has_ended(arm, loopback, settings):
    drive(arm, TWIST, 0.2)
    arm.close()
    arm.close()
    with pytest.raises(OperateError, match="after close"):
        arm.command_twist(TWIST, 0.1)
    with pytest.raises(OperateError, match="after close"):
        arm.read_states()
    again = UrArm(settings, CLOCK)
    again.close()


def test_nobody_there_is_a_connect_error_that_says_what_to_check():
    with pytest.raises(ConnectError, match="switched on"):
        UrArm(UrSettings(host="127.255.255.254", connect_timeout_s=5.0), CLOCK)


def test_a_stall_counts_as_a_timeout():
    assert issubclass(ArmStalledError, DeviceTimeoutError | TimeoutError)


def test_poses_of_the_controller_are_the_ones_of_its_tcp():
    T = transform((0.1, -0.2, 0.3, 0.0, 0.0, 1.0))
    assert np.allclose(T[:3, 3], [0.1, -0.2, 0.3])
