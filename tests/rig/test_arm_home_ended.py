"""``rig arm home`` ended from outside: the gantry must not home on without it."""

import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import WallClock
from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.server import LoopbackGantry
from tests.rig.command_line import RIG

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
# So slow that homing takes the better part of a minute.
MACHINE = Machine(max_rate=(1200.0,) * 6)
_TERM, _HANG_UP = signal.SIGTERM, signal.SIGHUP


@pytest.fixture
def gantry(tmp_path: Path) -> Iterator[LoopbackGantry]:
    start = MACHINE.column(MACHINE.joint_zero)
    with LoopbackGantry(MACHINE, start, tmp_path / "gantry", CLOCK) as running:
        yield running


@pytest.mark.parametrize(
    "signals",
    [
        pytest.param((_HANG_UP, _HANG_UP), id="a closed terminal says so twice"),
        pytest.param((_TERM,), id="terminated", marks=pytest.mark.slow),
        pytest.param((signal.SIGINT,), id="ctrl-c", marks=pytest.mark.slow),
    ],
)
def test_homing_stops_with_the_program(
    gantry: LoopbackGantry, signals: tuple[signal.Signals, ...]
) -> None:
    arguments = ("arm", "home", "--arm", "grbl", "--port", gantry.port, "--yes")
    with subprocess.Popen(
        [*RIG, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            begun_s = CLOCK.now_s()
            while not gantry.joints()[1].any():
                assert process.poll() is None and CLOCK.now_s() < begun_s + 30.0
                CLOCK.sleep_until(CLOCK.now_s() + 0.02)
            sent_s = CLOCK.now_s()
            for number in signals:
                os.kill(process.pid, number)
            _, said = process.communicate(timeout=15.0)
        finally:
            process.kill()
    assert process.returncode == 130
    assert said.strip() == "stopping the arm …"
    rows = gantry.motion(sent_s)
    moving = rows[np.any(rows[:, 7:] != 0.0, axis=1), 0]
    assert moving[-1] - sent_s < 0.5
    assert gantry.firmware.states.shown.startswith("Alarm")
