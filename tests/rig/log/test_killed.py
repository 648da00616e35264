"""Logs of runs that end badly: a disk that is full, a process that is killed."""

import json
import os
import resource
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import WallClock, time_of_day_offset_ns
from rig.log.lines import lines
from rig.log.reader import open_log
from tests.rig.command_line import RIG, rig

CLOCK = WallClock()
STARTS_WITHIN_S = 240.0


@contextmanager
def files_no_larger_than(size_bytes: int) -> Iterator[None]:
    """What a full disk does to the only large file that is written meanwhile."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_ends_the_recording_and_not_the_run(tmp_path: Path) -> None:
    arguments = ("--target", "sphere", "--duration", "1.5", "--json", "--out", str(tmp_path))
    with files_no_larger_than(5_000_000):
        result = rig("run", *arguments, "--set", "sim.renderer=raster")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["frames"] > 40
    assert result.stderr.count("the recording ends here, the run goes on") == 1
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert "File too large" in summary["log_error"]
    log = open_log(tmp_path)
    assert not log.finished
    assert log.end == log.path_bytes == summary["log_bytes"] <= 5_000_000
    assert len([line for line in lines(log) if line["kind"] == "tick"]) > 50


@pytest.mark.slow
@pytest.mark.parametrize("moment_s", [0.0, 0.13, 0.37, 0.71, 1.1])
def test_a_killed_run_leaves_everything_older_than_a_second(
    moment_s: float, tmp_path: Path
) -> None:
    """On the wall clock, images and all; stdout is the loop's own word for where it is."""
    out = tmp_path / "run"
    options = ["--target", "sphere", "--realtime", "--duration", "60", "--out", str(out)]
    process = subprocess.Popen(
        [*RIG, "run", *options, "--set", "sim.renderer=raster"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if line.startswith("t  2"):
                break
        CLOCK.sleep_until(CLOCK.now_s() + moment_s)
        killed_ns = round(CLOCK.now_s() * 1e9) + time_of_day_offset_ns()
        process.send_signal(signal.SIGKILL)
    finally:
        process.kill()
        process.communicate(timeout=STARTS_WITHIN_S)
    log = open_log(out)
    assert not log.finished
    newest: dict[str, int] = {}
    for record in log.records():
        newest[record.kind] = max(newest.get(record.kind, 0), record.logged_ns)
    assert {"arm", "frame", "image", "tick", "estimate", "command"} <= newest.keys()
    lost_s = {kind: (killed_ns - ns) * 1e-9 for kind, ns in newest.items()}
    print({kind: round(value, 3) for kind, value in lost_s.items()}, flush=True)
    for kind in ("arm", "frame", "image", "tick", "estimate", "command"):
        assert lost_s[kind] < 1.0, kind
    ticks_s = [record.values()["t_s"] for record in log.records(["tick"])]
    assert np.diff(ticks_s).max() < 0.5  # no hole before the end
    result = rig("replay", str(out), "--json")
    assert "identical to the run" in result.stderr
    assert rig("log", "repair", str(out)).exit_code == 0
    assert open_log(out).finished
