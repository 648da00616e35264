"""What goes wrong with a gantry, when it is noticed, and what it is called."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.errors import ConnectError, OperateError, RigError
from drivers.grbl import faults as driver_faults
from drivers.grbl import recovery
from drivers.grbl.errors import AlarmError, HeldError, RefusedError, ResetError, SilentError
from drivers.grbl.protocol import AlarmMessage
from drivers.grbl.session import Session
from sim_backend.loopback_grbl import faults
from sim_backend.loopback_grbl.machine import Machine
from tests.drivers.grbl.simulated import Gantry, settings_for

UART = Machine(clock_rate=1.0)
X = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def driving(machine: Machine = UART) -> Gantry:
    gantry = Gantry(machine)
    gantry.drive(0.05 * X, 0.5)
    return gantry


@pytest.mark.parametrize(
    ("fault", "kind", "words", "noticed_s", "rest_s"),
    [
        ("alarm", AlarmError, "limit switch", 0.03, 0.01),
        ("emergency_stop", AlarmError, "emergency stop", 0.03, 0.01),
        ("door", HeldError, "door", 0.06, 0.09),
        ("reset", AlarmError, "reset while moving", 0.03, 0.01),
        ("stall", SilentError, "has not answered for 0.25 s", 0.31, 0.25),
    ],
)
def test_a_fault_is_noticed_named_and_ends_in_rest(
    fault: str, kind: type[RigError], words: str, noticed_s: float, rest_s: float
) -> None:
    gantry = driving()
    begun_s = gantry.clock.now_s()
    faults.inject(gantry.firmware, fault)
    while gantry.core.failure is None and gantry.clock.now_s() < begun_s + 1.0:
        gantry.core.command(0.05 * X, 0.05, gantry.clock.now_s())
        gantry.run(0.002)
    assert gantry.clock.now_s() - begun_s < noticed_s
    assert isinstance(gantry.failure(), kind)
    assert words in str(gantry.failure())
    assert gantry.rest_after(begun_s) < rest_s
    # It stays failed, and nothing moves, whatever is commanded.
    rested_s = gantry.clock.now_s()
    gantry.core.command(0.05 * X, 0.5, rested_s)
    assert gantry.rest_after(rested_s, 0.5) == 0.0


def test_a_reset_at_rest_is_noticed_too() -> None:
    gantry = Gantry(UART)
    faults.inject(gantry.firmware, "reset")
    gantry.run(0.05)
    assert isinstance(gantry.failure(), ResetError)


def test_the_controllers_own_limits_are_a_refusal_in_words() -> None:
    # The configured range is wider than the controller's.
    wide = [
        {"letter": letter, "joint": joint, "mpos_at_zero": -800.0}
        for letter, joint in zip("XYZ", "xyz", strict=True)
    ]
    gantry = Gantry(Machine(clock_rate=1.0, axes=3), np.array([0.79, 0, 0, 0, 0, 0]), axes=wide)
    gantry.drive(0.05 * X, 1.0)
    assert isinstance(gantry.failure(), RefusedError)
    assert "error:15 (the jog leads beyond the controller's soft limits" in str(gantry.failure())
    gantry.run(0.5)
    assert not gantry.moving()


def test_lost_reports_are_no_failure() -> None:
    gantry = driving(Machine(clock_rate=1.0, lost_status=0.04))
    gantry.drive(0.01 * X, 10.0)
    assert gantry.core.failure is None


def test_acknowledgements_without_reports_are_a_failure_too() -> None:
    gantry = Gantry(UART)
    receive = gantry.core.receive

    def damaged(data: bytes, now_s: float) -> None:
        receive(re.sub(rb"[<>|]", b"~", data), now_s)

    gantry.core.receive = damaged  # type: ignore[method-assign]
    gantry.drive(0.02 * X, 2.0)
    assert isinstance(gantry.failure(), SilentError)


def test_a_gantry_that_only_needs_unlocking_connects_and_says_so() -> None:
    gantry = Gantry(UART)
    faults.inject(gantry.firmware, "alarm")
    gantry.run(0.1)
    gantry.link.write(b"\x18")
    gantry.run(0.2)
    again = Session(gantry.settings, gantry.clock, gantry.link)
    again.run_for(0.2)
    assert isinstance(again.core.failure, AlarmError)
    assert "locked" in str(again.core.failure)


@pytest.mark.parametrize("fault", ["alarm", "emergency_stop", "door", "reset", "stall"])
def test_after_a_recovery_it_rests_until_it_is_told_to_move(fault: str) -> None:
    gantry = driving()
    faults.inject(gantry.firmware, fault)
    gantry.drive(0.05 * X, 0.5)
    faults.clear(gantry.firmware, fault)
    gantry.run(0.3)
    recovery.unlock(gantry.link, gantry.clock, gantry.settings)
    session = Session(gantry.settings, gantry.clock, gantry.link)
    begun_s = gantry.clock.now_s()
    session.run_for(0.5)
    _, _, qd = gantry.motion(begun_s)
    assert not qd.any()
    assert session.core.failure is None
    session.core.command(0.05 * X, 0.5, gantry.clock.now_s())
    session.run_for(0.4)
    assert gantry.firmware.joints()[1][0, 0] == pytest.approx(0.05, rel=0.02)


def test_a_gantry_found_moving_is_stopped_by_a_recovery() -> None:
    gantry = Gantry(UART)
    gantry.link.write(b"$J=G91G21X100.000F6000\n")
    gantry.link.read(0.3)
    gantry.clock.sleep_until(gantry.clock.now_s() + 0.3)
    recovery.unlock(gantry.link, gantry.clock, gantry.settings)
    assert not gantry.moving()
    assert gantry.q()[0] < 0.06


@pytest.mark.parametrize(("fault", "why"), [("emergency_stop", "emergency"), ("door", "door")])
def test_what_is_still_pressed_cannot_be_recovered(fault: str, why: str) -> None:
    gantry = driving()
    faults.inject(gantry.firmware, fault)
    gantry.run(0.3)
    with pytest.raises(OperateError, match=why):
        recovery.unlock(gantry.link, gantry.clock, gantry.settings)


def test_homing_unlocks_and_drives_to_machine_zero() -> None:
    gantry = Gantry(UART)
    faults.inject(gantry.firmware, "reset")
    recovery.home(gantry.link, gantry.clock, gantry.settings)
    assert gantry.firmware.position() == pytest.approx(np.zeros(6), abs=1e-9)


def homing_error(gantry: Gantry) -> str:
    with pytest.raises(OperateError) as caught:
        recovery.home(gantry.link, gantry.clock, gantry.settings)
    return str(caught.value)


def test_homing_after_a_limit_switch_resets_first() -> None:
    gantry = driving()
    faults.inject(gantry.firmware, "alarm")
    gantry.run(0.2)
    recovery.home(gantry.link, gantry.clock, gantry.settings)
    assert gantry.firmware.position() == pytest.approx(np.zeros(6), abs=1e-9)


def test_a_controller_without_homing_says_so_and_nothing_moves() -> None:
    gantry = Gantry(Machine(homing=False))
    before = gantry.q()
    assert "homing is switched off ($22=0)" in homing_error(gantry)
    assert np.array_equal(gantry.q(), before)


@pytest.mark.parametrize(("fault", "why"), [("emergency_stop", "emergency"), ("door", "door")])
def test_nothing_is_homed_while_a_button_is_pressed_or_a_door_open(fault: str, why: str) -> None:
    gantry = Gantry(UART)
    before = gantry.q()
    faults.inject(gantry.firmware, fault)
    assert why in homing_error(gantry)
    assert np.array_equal(gantry.q(), before)


class Interrupted:
    """A link whose reader is interrupted at an instant, as by Ctrl-C."""

    def __init__(self, gantry: Gantry, at_s: float) -> None:
        self._gantry, self._at_s = gantry, at_s

    def read(self, wait_s: float) -> bytes:
        if self._gantry.clock.now_s() >= self._at_s:
            raise KeyboardInterrupt
        return self._gantry.link.read(wait_s)

    def write(self, data: bytes) -> None:
        self._gantry.link.write(data)

    def close(self) -> None:
        self._gantry.link.close()


def test_homing_that_is_interrupted_stops_at_once() -> None:
    gantry = Gantry(UART)
    link = Interrupted(gantry, gantry.clock.now_s() + 1.5)
    with pytest.raises(KeyboardInterrupt):
        recovery.home(link, gantry.clock, gantry.settings)
    gantry.link.read(0.1)
    assert not gantry.moving()
    assert np.abs(gantry.q()).max() > 0.05  # it was on its way


def test_a_homing_that_fails_is_reported_when_the_controller_says_so() -> None:
    gantry = Gantry(UART)

    class SwitchSticks(Interrupted):
        def read(self, wait_s: float) -> bytes:
            data = gantry.link.read(wait_s)
            if gantry.clock.now_s() >= self._at_s:
                self._at_s = float("inf")
                return data + b"ALARM:8\r\n"
            return data

    begun_s = gantry.clock.now_s()
    with pytest.raises(OperateError, match=r"could not be homed: ALARM:8.*did not open again"):
        recovery.home(SwitchSticks(gantry, begun_s + 1.5), gantry.clock, gantry.settings)
    assert gantry.clock.now_s() - begun_s < 3.0
    gantry.link.read(0.1)
    assert not gantry.moving()


def test_a_program_left_over_from_a_killed_client_is_cancelled_at_connect() -> None:
    gantry = Gantry(UART)
    for _ in range(50):
        gantry.link.write(b"$J=G91G21X1.000F3000\n")
    gantry.link.read(0.5)
    gantry.clock.sleep_until(gantry.clock.now_s() + 0.3)
    session = Session(gantry.settings, gantry.clock, gantry.link)
    assert not gantry.moving()
    session.run_for(0.3)
    assert session.core.failure is None


def test_rotary_axes_left_out_of_the_feed_are_refused_with_the_cure() -> None:
    with pytest.raises(ConnectError, match=r"type `\$701=0` once"):
        Gantry(Machine(rotary_in_norm=1))


def test_a_missing_axis_is_named() -> None:
    machine = Machine(axes=3)
    with pytest.raises(ConnectError, match="uses A, B, C"):
        Gantry(machine, axes=settings_for(UART).axes)


def test_plain_grbl_needs_no_setting_it_does_not_have() -> None:
    gantry = Gantry(Machine(flavour="Grbl", axes=3))
    assert gantry.core.failure is None
    assert gantry.session.controller.planner_blocks == 15


def test_a_silent_port_is_named() -> None:
    gantry = Gantry(UART)
    faults.inject(gantry.firmware, "stall")
    with pytest.raises(ConnectError, match="nothing that speaks Grbl answers"):
        Session(gantry.settings, gantry.clock, gantry.link)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.binary(max_size=80), max_size=15))
def test_garbage_from_the_line_never_raises_and_never_moves_the_arm(chunks: list[bytes]) -> None:
    gantry = Gantry(UART)
    begun_s = gantry.clock.now_s()
    for chunk in chunks:
        gantry.core.receive(chunk, gantry.clock.now_s())
        gantry.run(0.004)
    gantry.core.receive(b"\n", gantry.clock.now_s())
    gantry.run(0.2)
    assert not gantry.motion(begun_s)[2].any()
    assert gantry.core.failure is None or isinstance(gantry.core.failure, OperateError)


@settings(max_examples=12, deadline=None)
@given(
    st.integers(0, 300), st.sampled_from([b"\xff\x00\x81", b"<", b"ok", b"\n", b"error:", b"X1"])
)
def test_damaged_lines_in_full_motion_leave_a_safe_arm(when_ms: int, noise: bytes) -> None:
    gantry = Gantry(UART)
    gantry.drive(0.05 * X, 0.1 + 0.001 * when_ms)
    gantry.core.receive(noise, gantry.clock.now_s())
    gantry.drive(0.05 * X, 0.1)
    last_s = gantry.clock.now_s()
    assert gantry.rest_after(last_s, 0.6) < 0.05 + 0.10
    assert gantry.core.failure is None or isinstance(gantry.core.failure, OperateError)


@pytest.mark.parametrize(("code", "command"), [(1, "home"), (3, "home"), (2, "recover")])
def test_an_alarm_that_costs_the_position_is_ended_by_homing(code: int, command: str) -> None:
    said = str(driver_faults.from_message(AlarmMessage(code), "/dev/ttyACM0"))
    assert f"then `rig arm {command} --arm grbl --port /dev/ttyACM0`" in said
