"""A ``rig run`` that is finished or asked to stop: its arm stands still in time.

Measured at the controller. Asked: at rest within 150 ms plus the braking time.
"""

import contextlib
import os
import pty
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from rig.exit_codes import ExitCode
from tests.rig.loopback_run import CLOCK, ENDS_WITHIN_S, WATCHED_S, LoopbackRun, ended
from tests.rig.loopback_served import ArmKind, Served, served
from tests.rig.stopping import RAMP_S, REACTION_S, Stops, assert_complete

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]


@pytest.fixture(scope="module", params=["ur", "grbl"])
def rig(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Served]:
    arm: ArmKind = request.param
    if arm == "ur":
        pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    with served(arm, tmp_path_factory.mktemp("rig"), for_s=3600.0) as running:
        yield running


def test_a_finished_run_ends_at_rest(rig: Served, seeds: range, tmp_path: Path) -> None:
    stops = Stops(rig.arm, "finished")
    for seed in seeds:
        out = tmp_path / str(seed)
        run = LoopbackRun(rig, out, seed, ["--json", "--duration", "1.2"])
        try:
            run.wait_for_log("state stopping", 240.0)
            CLOCK.sleep_until(CLOCK.now_s() + 1.0)
            motion_until_s = rig.last_motion_s(CLOCK.now_s() - 5.0)
            result = run.finish(ENDS_WITHIN_S)
        finally:
            run.kill()
        stopping = [line for line in result.log if line.get("event") == "state stopping"]
        stops.add(motion_until_s - stopping[0]["t_s"], result)
        assert result.exit_code == ExitCode.OK, result.stderr
        assert_complete(result)
    stops.assert_within(REACTION_S + RAMP_S[rig.arm])


SIGNALS = {
    "SIGINT": [signal.SIGINT],
    "SIGTERM": [signal.SIGTERM],
    "SIGHUP": [signal.SIGHUP],
    "Ctrl-C twice": [signal.SIGINT] * 2,
    "Ctrl-C three times": [signal.SIGINT] * 3,
}


@pytest.mark.parametrize("how", SIGNALS)
def test_a_signal_ramps_to_rest_and_still_writes_everything(
    rig: Served, how: str, seeds: range, tmp_path: Path
) -> None:
    def send(run: LoopbackRun) -> Callable[[], object]:
        def each() -> None:
            for number in SIGNALS[how]:
                run.process.send_signal(number)
                CLOCK.sleep_until(CLOCK.now_s() + 0.02)

        return each

    stops = Stops(rig.arm, how)
    for seed in seeds:
        rest_s, result = ended(rig, seed, tmp_path / str(seed), send)
        stops.add(rest_s, result)
        assert result.exit_code == ExitCode.INTERRUPTED, result.stderr
        assert_complete(result)
        assert result.log[-1]["detail"] == "interrupted"
    stops.assert_within(REACTION_S + RAMP_S[rig.arm])


def test_a_closed_terminal_is_a_request_to_stop(rig: Served, seeds: range, tmp_path: Path) -> None:
    stops = Stops(rig.arm, "terminal closed")
    for seed in seeds:
        terminal, theirs = pty.openpty()
        run = LoopbackRun(rig, tmp_path / str(seed), seed, ["--duration", "30"], terminal=theirs)
        os.close(theirs)
        closing = threading.Event()
        reader = threading.Thread(target=_read_until, args=(terminal, closing), daemon=True)
        reader.start()
        try:
            run.wait_until_moving()
            closing.set()
            reader.join(5.0)
            begun_s = CLOCK.now_s()
            os.close(terminal)
            CLOCK.sleep_until(begun_s + WATCHED_S)
            rest_s = rig.last_motion_s(begun_s) - begun_s
            result = run.finish(ENDS_WITHIN_S)
        finally:
            run.kill()
        stops.add(rest_s, result)
        assert result.exit_code == ExitCode.INTERRUPTED
        assert result.left_behind == []
        assert result.summary is not None
        assert result.log[-1]["event"] == "ended" and result.log[-1]["detail"] == "interrupted"
    stops.assert_within(REACTION_S + RAMP_S[rig.arm])


def _read_until(terminal: int, closing: threading.Event) -> None:
    """Read along as a terminal does, so that the program never waits to be read."""
    os.set_blocking(terminal, False)
    while not closing.wait(0.01):
        with contextlib.suppress(OSError):
            os.read(terminal, 65536)


def test_output_that_nobody_reads_any_more_is_a_request_to_stop(
    rig: Served, seeds: range, tmp_path: Path
) -> None:
    """``rig run | head -1``."""
    stops = Stops(rig.arm, "broken pipe")
    for seed in seeds:
        out = tmp_path / str(seed)
        run = LoopbackRun(rig, out, seed, ["--duration", "30"], piped=True)
        try:
            run.wait_until_moving()
            assert run.process.stdout is not None
            run.process.stdout.readline()
            run.process.stdout.close()
            run.wait_for_log("state stopping", 10.0)
            CLOCK.sleep_until(CLOCK.now_s() + 1.0)
            motion_until_s = rig.last_motion_s(CLOCK.now_s() - 5.0)
            result = run.finish(ENDS_WITHIN_S)
        finally:
            run.kill()
        stopping = [line for line in result.log if line.get("event") == "state stopping"]
        stops.add(motion_until_s - stopping[0]["t_s"], result)
        assert result.exit_code == ExitCode.INTERRUPTED, result.stderr
        assert result.left_behind == []
        assert result.summary is not None
        assert result.log[-1]["event"] == "ended"
        assert "Traceback" not in result.stderr
    stops.assert_within(REACTION_S + RAMP_S[rig.arm])


def test_ctrl_c_while_everything_is_still_being_opened(
    rig: Served, seeds: range, tmp_path: Path
) -> None:
    stops = Stops(rig.arm, "Ctrl-C at start-up")
    for seed in seeds:
        random = np.random.default_rng([seed, 47])
        out = tmp_path / str(seed)
        run = LoopbackRun(rig, out, seed, ["--json", "--duration", "30"])
        try:
            # From Python's own start to the first ticks.
            CLOCK.sleep_until(CLOCK.now_s() + float(random.uniform(0.1, 5.0)))
            begun_s = CLOCK.now_s()
            run.process.send_signal(signal.SIGINT)
            CLOCK.sleep_until(begun_s + WATCHED_S)
            rest_s = rig.last_motion_s(begun_s) - begun_s
            result = run.finish(ENDS_WITHIN_S)
        finally:
            run.kill()
        stops.add(rest_s, result)
        # Before the program's own first line the shell's 130 is Python's −SIGINT.
        assert result.exit_code in (ExitCode.INTERRUPTED, -signal.SIGINT), result.stderr
        assert result.left_behind == []
        if result.log:  # by then the loop had begun
            assert result.events()[-1] == "ended"
        if "state running" in result.events():
            assert result.summary is not None
    stops.assert_within(REACTION_S + RAMP_S[rig.arm])


def test_head_ends_the_run_without_a_complaint(rig: Served, tmp_path: Path) -> None:
    """The pipe as a shell makes it."""
    arguments = " ".join(f"'{argument}'" for argument in rig.arguments())
    program = f"{sys.executable} -c 'from rig.cli import main; main()'"
    done = subprocess.run(
        ["bash", "-c", f"{program} run {arguments} --out {tmp_path / 'run'} | head -1"],
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.stdout.count("\n") == 1
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr
    assert (tmp_path / "run" / "summary.json").is_file()
