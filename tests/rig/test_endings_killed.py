"""A ``rig run`` that breaks or is killed: its arm stands still in time.

Measured at the controller. Asked: at rest within 150 ms plus the braking time; after SIGKILL of
the program within the controller's watchdog period plus braking. A gantry has no watchdog; its
queue, kept short, runs out instead.
"""

import os
import re
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rig.exit_codes import ExitCode
from tests.rig.loopback_run import CLOCK, ENDS_WITHIN_S, WATCHED_S, LoopbackRun, ended
from tests.rig.loopback_served import ArmKind, Served, served
from tests.rig.stopping import RAMP_S, REACTION_S, WATCHDOG_S, Stops, assert_complete

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]

# Braked by the driver or the controller, not along the rig's own ramp.
HARD_STOP_S: dict[ArmKind, float] = {"ur": 0.08, "grbl": 0.12}

# The rig's program with a fault of its own: an exception somewhere in the control loop.
BREAKS = """
import sys
from drivers.clock import WallClock
from rig.fusion import Fusion
advance, left = Fusion.advance, [25]
def breaking(self, now_s):
    left[0] -= self.camera_speed_m_s() > 0.03
    if left[0] < 0:
        print(f"breaks at {WallClock().now_s()!r}", file=sys.stderr, flush=True)
        raise ZeroDivisionError("a fault of the program")
    return advance(self, now_s)
Fusion.advance = breaking
from rig.cli import main
main()
"""


@pytest.fixture(scope="module", params=["ur", "grbl"])
def rig(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Served]:
    arm: ArmKind = request.param
    if arm == "ur":
        pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    with served(arm, tmp_path_factory.mktemp("rig"), for_s=3600.0) as running:
        yield running


def test_an_exception_in_the_loop_stops_the_arm_and_is_shown(
    rig: Served, seeds: range, tmp_path: Path
) -> None:
    stops = Stops(rig.arm, "exception")
    for seed in seeds:
        out = tmp_path / str(seed)
        command = (sys.executable, "-c", BREAKS)
        run = LoopbackRun(rig, out, seed, ["--json", "--duration", "30"], command)
        try:
            begun_s = _told(run, r"breaks at ([\d.]+)")
            CLOCK.sleep_until(begun_s + WATCHED_S)
            rest_s = rig.last_motion_s(begun_s) - begun_s
            result = run.finish(ENDS_WITHIN_S)
        finally:
            run.kill()
        stops.add(rest_s, result)
        assert result.exit_code == ExitCode.INTERNAL, result.stderr
        assert "a fault of the program" in result.stderr
        assert result.left_behind == []
        assert result.events()[-1] == "ended"
        assert "a fault of the program" in result.log[-1]["detail"]
    stops.assert_within(REACTION_S + HARD_STOP_S[rig.arm])


def _told(run: LoopbackRun, pattern: str) -> float:
    """The number that the program printed, as soon as it did."""
    give_up_s = CLOCK.now_s() + 240.0
    while (found := re.search(pattern, run.said())) is None:
        assert run.process.poll() is None and CLOCK.now_s() < give_up_s, run.said()
        CLOCK.sleep_until(CLOCK.now_s() + 0.02)
    return float(found.group(1))


def test_a_killed_program_leaves_the_arm_to_its_own_time_limits(
    rig: Served, seeds: range, tmp_path: Path
) -> None:
    stops = Stops(rig.arm, "SIGKILL")
    for seed in seeds:
        rest_s, result = ended(rig, seed, tmp_path / str(seed), lambda run: run.process.kill)
        stops.add(rest_s, result)
        assert result.exit_code == -signal.SIGKILL
        assert result.left_behind == []
        assert "state running" in result.events()  # what was logged by then is whole
        rig.mend()
    stops.assert_within(WATCHDOG_S[rig.arm] + HARD_STOP_S[rig.arm])


@pytest.mark.parametrize("which", ["drivers.ur.child", "rig.vision.child"])
def test_a_killed_child_is_a_device_failure(
    rig: Served, which: str, seeds: range, tmp_path: Path
) -> None:
    if which == "drivers.ur.child" and rig.arm != "ur":
        pytest.skip("the serial driver has no process of its own")

    def kill(run: LoopbackRun) -> Callable[[], object]:
        (pid,) = run.processes(which)
        return lambda: os.kill(pid, signal.SIGKILL)

    stops = Stops(rig.arm, f"SIGKILL of {which}")
    for seed in seeds:
        rest_s, result = ended(rig, seed, tmp_path / str(seed), kill)
        stops.add(rest_s, result)
        assert result.exit_code == ExitCode.DEVICE, result.stderr
        assert_complete(result)
        assert result.summary is not None
        assert "died" in result.summary["error"]
        rig.mend()
    braking_s = HARD_STOP_S if which == "drivers.ur.child" else RAMP_S
    stops.assert_within(REACTION_S + braking_s[rig.arm])
