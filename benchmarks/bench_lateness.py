"""Lateness of the control loop under camera and vision load, beside that of a bare loop.

Run with ``python -m benchmarks.bench_lateness [--seconds 60] [--rig ur|sim] [--set a.b=value]``.
The whole of ``rig run`` works on the wall clock; a bare loop of the same period, absolute
deadlines and nothing else, runs beside it in a process of its own and suffers the same load.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.config_load import packaged_config
from rig.log.reader import open_log

FloatArray = NDArray[np.float64]

RIG = (sys.executable, "-c", "from rig.cli import main; main()")
PERIOD_S = 0.01
HOLD_S = 0.05
HOST = "127.0.0.43"
# Slow enough that the arm still has room after a minute.
VELOCITY = "motion.velocity_m_s=[-0.004,0,0]"


@dataclass(frozen=True, slots=True)
class Comparison:
    """One run and the bare loop beside it."""

    summary: dict[str, float]
    commands_s: FloatArray  # (n,) instants
    bare_s: FloatArray  # (m,) lateness of the bare loop while commands were given

    @property
    def ratio(self) -> float:
        """The 99th percentile of the control loop's lateness over that of the bare loop."""
        return self.summary["tick_late_p99_s"] / float(np.percentile(self.bare_s, 99))

    @property
    def missed(self) -> int:
        """Commands that came later than the one before them lived."""
        return int(np.sum(np.diff(self.commands_s) > HOLD_S))


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rig", choices=("ur", "sim"), default="ur")
    parser.add_argument("--set", action="append", default=[], metavar="a.b=value")
    parser.add_argument("--bare", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.bare:
        bare_loop()
        return
    print(f"load before: {os.getloadavg()[0]:.1f} of {os.cpu_count()} processors")
    found = compare(arguments.rig, arguments.seconds, arguments.set)
    print(f"load after: {os.getloadavg()[0]:.1f}")
    report(found)


def compare(kind: str, seconds: float, assignments: list[str]) -> Comparison:
    """Run the loop of the rig ``kind`` ("ur" or "sim") with the bare loop beside it."""
    with tempfile.TemporaryDirectory() as scratch:
        run_dir = Path(scratch) / "run"
        options = ["--target", "sphere", "--json", "--out", str(run_dir)]
        options += ["--duration", str(seconds)]
        options += [text for one in (VELOCITY, *assignments) for text in ("--set", one)]
        if kind == "ur":
            with emulated_ur() as stream:
                options += ["--rig", str(packaged_config("loopback_ur5e.yaml"))]
                options += ["--set", f"arm.host={HOST}", "--set", f"camera.source={stream}"]
                bare = run_beside(options)
        else:
            bare = run_beside([*options, "--realtime"])
        commands_s = commands_of(run_dir)
        during = (bare[:, 0] >= commands_s[0]) & (bare[:, 0] <= commands_s[-1])
        summary = json.loads((run_dir / "summary.json").read_text())
        return Comparison(summary, commands_s, bare[during, 1])


def bare_loop() -> None:
    """Keep absolute deadlines until standard input closes; print (instant, lateness) lines."""
    samples = []
    os.set_blocking(0, False)
    deadline_s = time.monotonic()
    while _input_open():
        deadline_s += PERIOD_S
        time.sleep(max(0.0, deadline_s - time.monotonic()))
        now_s = time.monotonic()
        samples.append((now_s, now_s - deadline_s))
    np.savetxt(sys.stdout, np.array(samples))


def _input_open() -> bool:
    try:
        return os.read(0, 1) != b""
    except BlockingIOError:
        return True


def run_beside(options: list[str]) -> FloatArray:
    """``rig run`` with the bare loop beside it; the bare loop's samples (n, 2)."""
    command = [sys.executable, "-m", "benchmarks.bench_lateness", "--bare"]
    with (
        tempfile.TemporaryFile() as output,
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=output) as bare,
    ):
        said = subprocess.run([*RIG, "run", *options], capture_output=True, text=True, check=False)
        bare.communicate()  # closes its input, which ends it
        if said.returncode != 0:
            raise RuntimeError(f"rig run: exit status {said.returncode}: {said.stderr[-2000:]}")
        output.seek(0)
        return np.loadtxt(output)


@contextmanager
def emulated_ur() -> Iterator[str]:
    """``rig sim serve`` until the block ends; the camera stream's address."""
    command = [*RIG, "sim", "serve", "--arm", "ur", "--camera", "--host", HOST, "--port", "0"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(
        [*command, "--set", "sim.renderer=raster"],
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    ) as server:
        try:
            assert server.stderr is not None
            said = server.stderr.readline()
            found = re.search(r"http://\S+?\.mjpg", said)
            if found is None:
                raise RuntimeError(f"rig sim serve said: {said}")
            yield found.group(0)
        finally:
            server.terminate()


def commands_of(run_dir: Path) -> FloatArray:
    """The instants (n,) of the commands of a run."""
    records = open_log(run_dir).records(["command"])
    return np.array([record.values()["t_s"] for record in records])


def report(found: Comparison) -> None:
    """Print both loops' figures."""
    summary, bare_ms = found.summary, 1e3 * found.bare_s
    print(
        f"control loop: p99 {1e3 * summary['tick_late_p99_s']:.3f} ms, {summary['ticks']} ticks, "
        f"{summary['overruns']} overruns, {summary['frames']} frames\n"
        f"bare loop: p99 {np.percentile(bare_ms, 99):.3f} ms, median {np.median(bare_ms):.3f} ms, "
        f"most {bare_ms.max():.3f} ms ({len(bare_ms)})\n"
        f"ratio of the 99th percentiles: {found.ratio:.2f}\n"
        f"longest gap between commands {1e3 * np.diff(found.commands_s).max():.1f} ms, "
        f"{found.missed} longer than a command lives ({1e3 * HOLD_S:.0f} ms)"
    )


if __name__ == "__main__":
    main()
