"""The arm through the real vendor package, measured at the controller it talks to.

What it owes as an ``Arm`` is held by ``tests/contract``; here is what is its own.
"""

from contextlib import closing

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
from drivers.ur.listener import UrListener
from drivers.ur.settings import UrSettings
from sim_backend.loopback_ur.kinematics import transform
from tests.drivers.ur.loopback import drive, last_motion_s

pytestmark = pytest.mark.realtime

TWIST = np.array([0.04, 0.0, 0.02, 0.0, 0.0, 0.1])
CLOCK = WallClock()


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
    assert np.allclose(arm.tcp_offset(), 0.0, atol=1e-12)
    arm.close()
    pinned = UrSettings(host=loopback.host, tcp_offset=(0.0, 0.0, 0.12, 0.0, 0.0, 0.0))
    with pytest.raises(ConnectError, match=r"0\.12000.*calibrate again"):
        UrArm(pinned, CLOCK)


def test_who_only_listens_hears_of_the_same_tcp(loopback, settings):
    offset = (0.01, -0.02, 0.12, 0.1, -0.2, 0.3)
    loopback.control.tcp(offset)
    try:
        with closing(UrListener(settings, CLOCK)) as listener:
            assert np.allclose(listener.tcp_offset(), offset)
    finally:
        loopback.control.tcp((0.0,) * 6)


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
