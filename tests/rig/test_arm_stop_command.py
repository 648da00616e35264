"""``rig arm stop`` while something else moves the arm, as a person types it."""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import WallClock
from drivers.grbl.link import SerialLink
from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.server import LoopbackGantry
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
