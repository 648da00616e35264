"""Stopping a gantry that somebody else set moving, on simulated time."""

import dataclasses

import numpy as np
import pytest

from drivers.errors import OperateError
from drivers.grbl.errors import PortLostError
from drivers.grbl.stopping import stop_motion
from sim_backend.clock import SimulatedClock
from sim_backend.loopback_grbl import faults
from sim_backend.loopback_grbl.direct import DirectLink
from sim_backend.loopback_grbl.firmware import Firmware
from sim_backend.loopback_grbl.machine import Machine
from tests.drivers.grbl.simulated import START_S, settings_for

HAL = Machine()
PLAIN = Machine(flavour="Grbl", axes=3)


class Workshop:
    """A gantry in the middle of its range, and who else writes to it."""

    def __init__(self, machine: Machine = HAL) -> None:
        self.clock = SimulatedClock(START_S)
        start = machine.column(machine.joint_zero)
        self.firmware = Firmware(machine, start, START_S)
        self.link = DirectLink(self.firmware, self.clock)
        self.settings = settings_for(machine)

    def somebody_sends(self, text: str, span_s: float = 0.5) -> None:
        """Bytes from a program that is gone by now, and some time."""
        self.link.write(text.encode())
        self.wait(span_s)

    def wait(self, span_s: float) -> None:
        """Let time pass; what the controller says goes to nobody."""
        end_s = self.clock.now_s() + span_s
        while self.clock.now_s() < end_s:
            self.link.read(0.01)

    def stop(self) -> str:
        return stop_motion(self.link, self.clock, self.settings)

    def x_m(self) -> float:
        return float(self.firmware.joints()[0][0, 0])

    def moving(self) -> bool:
        return bool(np.any(self.firmware.joints()[1]))

    def never_moves_again(self) -> bool:
        """Not even where somebody presses cycle start."""
        before = self.x_m()
        self.somebody_sends("~", 1.0)
        return not self.moving() and self.x_m() == before

    @property
    def state(self) -> str:
        return self.firmware.states.shown


@pytest.fixture(params=[HAL, PLAIN], ids=["grblHAL", "Grbl"])
def workshop(request: pytest.FixtureRequest) -> Workshop:
    return Workshop(request.param)


def test_a_program_is_braked_and_dropped(workshop: Workshop) -> None:
    workshop.somebody_sends("G91G1X300F3000\n")
    before_m = workshop.x_m()
    said = workshop.stop()
    assert "stands still" in said and "program was held" in said
    assert 0.004 < workshop.x_m() - before_m < 0.010  # braked, not torn to a halt
    assert workshop.state == "Idle"
    assert workshop.never_moves_again()


def test_homing_is_ended_at_once_and_leaves_it_locked(workshop: Workshop) -> None:
    workshop.somebody_sends("$H\n", 0.3)
    assert workshop.moving()
    begun_s = workshop.clock.now_s()
    said = workshop.stop()
    assert "rig arm home" in said and "state Home" in said
    history = workshop.firmware.history
    first = round((begun_s - history.start_s) / history.step_s)
    moved = np.any(history.entries(np.arange(first, history.count))[1] != 0.0, axis=1)
    assert np.flatnonzero(moved)[-1] * history.step_s < 0.1
    assert workshop.state.startswith("Alarm")
    assert workshop.never_moves_again()


def test_a_jog_is_cancelled_and_the_gantry_stays_ready(workshop: Workshop) -> None:
    workshop.somebody_sends("$J=G91G21X300F3000\n")
    before_m = workshop.x_m()
    assert "jog was cancelled" in workshop.stop()
    assert workshop.x_m() - before_m < 0.006
    assert workshop.state == "Idle"
    assert workshop.never_moves_again()


def test_what_is_held_cannot_be_resumed_any_more(workshop: Workshop) -> None:
    workshop.somebody_sends("G91G1X300F3000\n")
    workshop.somebody_sends("!", 0.05)
    assert workshop.state == "Hold:1"
    before_m = workshop.x_m()
    workshop.stop()
    assert workshop.x_m() - before_m > 0.002  # it came to its hold before it was reset
    assert workshop.never_moves_again()


def test_behind_an_open_door_nothing_waits_to_go_on(workshop: Workshop) -> None:
    workshop.somebody_sends("G91G1X300F3000\n")
    faults.inject(workshop.firmware, "door")
    assert "state Door" in workshop.stop()
    faults.clear(workshop.firmware, "door")
    assert workshop.never_moves_again()


def test_a_gantry_at_rest_is_left_alone(workshop: Workshop) -> None:
    assert "did already" in workshop.stop()
    assert workshop.state == "Idle"
    faults.inject(workshop.firmware, "alarm")
    assert "did already. It is locked" in workshop.stop()
    assert workshop.state == "Alarm:1"


class StubbornLink(DirectLink):
    """Real-time orders are lost on the way, status requests are not."""

    lost: bytes = b"\x85!\x18"

    def write(self, data: bytes) -> None:
        super().write(bytes(byte for byte in data if byte not in self.lost))


def test_a_program_that_no_hold_stops_is_reset() -> None:
    workshop = Workshop()
    workshop.link = StubbornLink(workshop.firmware, workshop.clock)
    workshop.link.lost = b"!"
    workshop.somebody_sends("G91G1X300F3000\n")
    assert "state Run" in workshop.stop()
    assert workshop.never_moves_again()


@pytest.mark.parametrize("line", ["G91G1X700F300\n", "$H\n", "$J=G91G21X700F300\n"])
def test_one_that_moves_on_is_never_called_stopped(line: str) -> None:
    slow = dataclasses.replace(HAL, max_rate=(600.0,) * 6)
    workshop = Workshop(slow)
    workshop.link = StubbornLink(workshop.firmware, workshop.clock)
    workshop.somebody_sends(line)
    with pytest.raises(OperateError, match=r"state (Run|Home|Jog).*emergency stop"):
        workshop.stop()
    assert workshop.moving()


def test_one_that_does_not_answer_is_reset_blindly_and_not_called_stopped() -> None:
    workshop = Workshop()
    workshop.somebody_sends("G91G1X700F300\n")
    workshop.link.read = lambda timeout_s: DirectLink.read(workshop.link, timeout_s)[:0]  # type: ignore[method-assign]
    with pytest.raises(OperateError, match=r"not known: use the emergency stop"):
        workshop.stop()
    workshop.wait(0.1)
    assert workshop.never_moves_again()


def test_a_port_lost_meanwhile_names_the_emergency_stop() -> None:
    workshop = Workshop()

    def gone(data: bytes) -> None:
        raise PortLostError("the serial port is gone")

    workshop.link.write = gone  # type: ignore[method-assign]
    with pytest.raises(PortLostError, match=r"gone.*emergency stop"):
        workshop.stop()
