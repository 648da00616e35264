"""``rig arm stop`` while something else moves the arm, as a person types it."""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import WallClock
from drivers.grbl.link import SerialLink
from drivers.ur import stopping
from drivers.ur.arm import UrArm
from drivers.ur.dashboard import Dashboard
from drivers.ur.settings import UrSettings
from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.server import LoopbackGantry
from sim_backend.loopback_ur.process import LoopbackProcess
from tests.drivers.ur.loopback import last_motion_s, start_loopback
from tests.rig.command_line import rig

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
MACHINE = Machine()


@pytest.fixture
def gantry(tmp_path: Path) -> Iterator[LoopbackGantry]:
    start = MACHINE.column(MACHINE.joint_zero)
    with LoopbackGantry(MACHINE, start, tmp_path / "gantry", CLOCK) as running:
        yield running


def sent_by_somebody(gantry: LoopbackGantry, line: str) -> None:
    """A line from a program that ends at once; the gantry moves when this returns."""
    port = os.open(gantry.port, os.O_RDWR | os.O_NOCTTY)
    try:
        os.write(port, line.encode() + b"\n")
    finally:
        os.close(port)
    deadline_s = CLOCK.now_s() + 5.0
    while not gantry.joints()[1].any():
        assert CLOCK.now_s() < deadline_s
        CLOCK.sleep_until(CLOCK.now_s() + 0.01)


@pytest.mark.parametrize("line", ["G91G1X500F600", "$H"])
def test_a_gantry_that_somebody_else_moves_stands_still_when_it_says_so(
    gantry: LoopbackGantry, line: str
) -> None:
    sent_by_somebody(gantry, line)
    outcome = rig("arm", "stop", "--arm", "grbl", "--port", gantry.port)
    said_s = CLOCK.now_s()
    assert outcome.exit_code == 0
    assert "stands still" in outcome.stdout
    CLOCK.sleep_until(said_s + 0.3)
    assert not np.any(gantry.motion(said_s)[:, 7:])


def test_a_gantry_whose_port_is_taken_is_not_called_stopped(gantry: LoopbackGantry) -> None:
    other = SerialLink(gantry.port, MACHINE.baud)
    try:
        sent_by_somebody(gantry, "G91G1X500F600")
        outcome = rig("arm", "stop", "--arm", "grbl", "--port", gantry.port)
    finally:
        other.close()
    assert outcome.exit_code == 3
    assert outcome.stdout == ""
    assert "another program uses it" in outcome.stderr
    assert "Nothing was stopped" in outcome.stderr and "emergency stop" in outcome.stderr


@pytest.fixture(scope="module")
def loopback() -> Iterator[LoopbackProcess]:
    with start_loopback() as process:
        yield process


@pytest.fixture
def driven(loopback: LoopbackProcess) -> Iterator[UrArm]:
    """An arm that another program moves, and goes on moving for 10 s."""
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    arm = UrArm(UrSettings(host=loopback.host), CLOCK)
    try:
        arm.command_twist(np.array([0.02, 0.0, 0.01, 0.0, 0.0, 0.0]), 10.0)
        begun_s = CLOCK.now_s()
        while last_motion_s(loopback, begun_s) == begun_s:
            assert CLOCK.now_s() < begun_s + 5.0
            CLOCK.sleep_until(CLOCK.now_s() + 0.02)
        yield arm
    finally:
        arm.close()


def test_a_ur_arm_that_another_program_moves_stands_still_when_it_says_so(
    loopback: LoopbackProcess, driven: UrArm
) -> None:
    outcome = rig("arm", "stop", "--arm", "ur", "--host", loopback.host)
    said_s = CLOCK.now_s()
    assert outcome.exit_code == 0
    assert "stands still and no program runs" in outcome.stdout
    CLOCK.sleep_until(said_s + 0.3)
    assert last_motion_s(loopback, said_s) == said_s


def test_a_ur_arm_whose_controller_refuses_is_not_called_stopped(
    loopback: LoopbackProcess, driven: UrArm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As one in local control may do."""
    refusal = "Failed to execute: stop"
    monkeypatch.setattr(Dashboard, "ask", lambda dashboard, command: refusal)
    monkeypatch.setattr(stopping, "_REST_TIMEOUT_S", 0.5)
    outcome = rig("arm", "stop", "--arm", "ur", "--host", loopback.host)
    said_s = CLOCK.now_s()
    assert outcome.exit_code == 3
    assert outcome.stdout == ""
    said = " ".join(outcome.stderr.split())
    assert refusal in said and "its program is playing: use the emergency stop" in said
    CLOCK.sleep_until(said_s + 0.1)
    assert last_motion_s(loopback, said_s) > said_s
