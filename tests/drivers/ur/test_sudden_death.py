"""However the program dies, the arm stands still; measured at the controller."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from drivers.clock import WallClock
from sim_backend.loopback_ur.process import LoopbackProcess
from tests.drivers.ur.loopback import last_motion_s

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
WATCHDOG_HZ = 10.0
BRAKING_S = 0.1  # from 45 mm/s
HOST_IS_BUSY_S = 0.25


class Driver:
    """The program under test."""

    def __init__(self, host: str) -> None:
        command = [sys.executable, "-m", "tests.drivers.ur.drive_forever", host, str(WATCHDOG_HZ)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE)
        assert self.process.stdout is not None
        self.child_pid = int(self.process.stdout.readline())

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.fixture
def driver(loopback: LoopbackProcess) -> Iterator[Driver]:
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    running = Driver(loopback.host)
    yield running
    running.close()


def stop_s(loopback: LoopbackProcess, killed_s: float) -> float:
    """How long the arm moved on."""
    CLOCK.sleep_until(killed_s + 0.8)
    return last_motion_s(loopback, killed_s - 0.1) - killed_s


def test_a_killed_program_stops_the_arm_through_its_child(driver, loopback):
    killed_s = CLOCK.now_s()
    os.kill(driver.process.pid, signal.SIGKILL)
    taken_s = stop_s(loopback, killed_s)
    print(f"program killed: moved on for {1e3 * taken_s:.0f} ms")
    assert taken_s < BRAKING_S + HOST_IS_BUSY_S


def test_with_the_child_killed_too_the_watchdog_stops_the_arm(driver, loopback):
    killed_s = CLOCK.now_s()
    os.kill(driver.child_pid, signal.SIGKILL)
    os.kill(driver.process.pid, signal.SIGKILL)
    taken_s = stop_s(loopback, killed_s)
    print(f"program and child killed: moved on for {1e3 * taken_s:.0f} ms")
    assert taken_s < 1.0 / WATCHDOG_HZ + BRAKING_S + HOST_IS_BUSY_S


def test_a_dead_child_is_an_error_in_the_program_which_then_ends(driver, loopback):
    killed_s = CLOCK.now_s()
    os.kill(driver.child_pid, signal.SIGSEGV)
    assert stop_s(loopback, killed_s) < 1.0 / WATCHDOG_HZ + BRAKING_S + HOST_IS_BUSY_S
    assert driver.process.wait(5.0) != 0


def test_a_frozen_child_is_stopped_by_the_watchdog(driver, loopback):
    killed_s = CLOCK.now_s()
    os.kill(driver.child_pid, signal.SIGSTOP)
    try:
        assert stop_s(loopback, killed_s) < 1.0 / WATCHDOG_HZ + BRAKING_S + HOST_IS_BUSY_S
        assert driver.process.wait(5.0) != 0  # it noticed that the states stopped
    finally:
        os.kill(driver.child_pid, signal.SIGKILL)
