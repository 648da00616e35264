"""The pty around the firmware: short, in real time, with wide bounds."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import serial

from drivers.clock import WallClock
from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.process import LoopbackGantryProcess
from sim_backend.loopback_grbl.server import LoopbackGantry

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
MACHINE = Machine(lost_status=0.0)


@pytest.fixture
def gantry() -> Iterator[LoopbackGantry]:
    with LoopbackGantry(MACHINE, MACHINE.column(MACHINE.joint_zero), clock=CLOCK) as running:
        yield running


def until(condition: Callable[[], bool], most_s: float = 3.0) -> bool:
    end_s = CLOCK.now_s() + most_s
    while CLOCK.now_s() < end_s:
        if condition():
            return True
        CLOCK.sleep_until(CLOCK.now_s() + 0.005)
    return False


def test_opening_prints_nothing_and_a_request_is_answered(gantry: LoopbackGantry) -> None:
    with serial.Serial(gantry.port, 115200, timeout=0.1) as port:
        assert port.read(10) == b""
        port.write(b"?")
        port.timeout = 2.0
        assert port.read_until(b"\r\n").startswith(b"<Idle|MPos:-800.000,")


def test_what_a_client_queued_runs_on_after_it_closed_the_port(gantry: LoopbackGantry) -> None:
    with serial.Serial(gantry.port, 115200, timeout=0.5) as port:
        port.write(b"$J=G91G21X1.000F3000\n" * 10)  # 0.2 s
        for _ in range(10):
            assert port.read_until(b"\n") == b"ok\r\n"
    assert until(lambda: abs(gantry.joints()[0][0] - 0.010) < 1e-9)


def test_a_client_may_come_again(gantry: LoopbackGantry) -> None:
    for _ in range(3):
        with serial.Serial(gantry.port, 115200, timeout=2.0) as port:
            port.write(b"\n")
            assert port.read_until(b"\n") == b"ok\r\n"


def test_a_pulled_cable_is_an_error_for_the_client_and_can_be_plugged_in_again(
    tmp_path: Path,
) -> None:
    link = tmp_path / "gantry"
    start = MACHINE.column(MACHINE.joint_zero)
    with LoopbackGantry(MACHINE, start, link, CLOCK) as gantry:
        assert gantry.port == str(link)
        with serial.Serial(gantry.port, 115200, timeout=1.0) as port:
            gantry.inject("drop")
            with pytest.raises((serial.SerialException, OSError)):
                while True:
                    port.write(b"?")
                    port.read(1)
        assert not link.exists()
        gantry.clear("drop")
        with serial.Serial(gantry.port, 115200, timeout=2.0) as port:
            port.write(b"\n")
            assert port.read_until(b"\n") == b"ok\r\n"
    assert not link.exists()


def test_the_history_follows_the_clock(gantry: LoopbackGantry) -> None:
    CLOCK.sleep_until(CLOCK.now_s() + 0.02)
    now_s = gantry.sync()
    # A millisecond apart, the last one at most that old.
    assert gantry.history.at(now_s - 0.0015)[0] == pytest.approx(np.zeros(6))
    rows = gantry.motion(now_s - 0.010)
    assert rows.shape[1] == 13
    assert rows[-1, 0] >= now_s - 0.0011
    assert np.diff(rows[:, 0]) == pytest.approx(0.001)


def test_closing_twice_is_harmless_and_ends_the_thread() -> None:
    gantry = LoopbackGantry(MACHINE, MACHINE.column(MACHINE.joint_zero), clock=CLOCK)
    gantry.close()
    gantry.close()
    with pytest.raises((serial.SerialException, OSError)):
        os.close(os.open(gantry.port, os.O_RDWR | os.O_NOCTTY))


def test_a_gantry_in_its_own_process_moves_fails_and_tells_the_truth(tmp_path: Path) -> None:
    with LoopbackGantryProcess(tmp_path / "gantry", ("--seed", "3")) as gantry:
        begun_s = CLOCK.now_s()
        with serial.Serial(str(gantry.port), 115200, timeout=2.0) as port:
            port.write(b"$J=G91G21X1.000F3000\n")
            assert port.read_until(b"\n") == b"ok\r\n"
            assert until(lambda: bool(gantry.control.motion(begun_s)[-1, 1] > 0.00099))
            gantry.control.fault("door", after_s=0.02, for_s=0.2)
            assert until(lambda: _state(port) in ("Door:1", "Door:2"))
            assert until(lambda: _state(port) == "Door:0")
        with pytest.raises(ValueError, match="known: alarm, door"):
            gantry.control.fault("fire")
    assert not gantry.port.exists()


def _state(port: serial.Serial) -> str:
    port.write(b"?")
    return str(port.read_until(b"\n").decode()[1:].split("|")[0])
