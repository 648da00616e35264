"""What recording costs: the control loop per tick, its thread, the disk; and how fast replays are.

Run with ``python -m benchmarks.bench_log``. Processor time, so that other load matters little; the
first run of each kind warms up and is not counted.
"""

import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from drivers.clock import WallClock
from drivers.interfaces import ArmState, Frame
from estimator.estimate import Estimate
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import Intrinsics
from rig.config_load import load_config
from rig.live import QuietView
from rig.log.header import LogHeader
from rig.log.run_log import RunLog, open_run_log
from rig.replay.engine import replay
from rig.replay.recording import open_recording
from rig.replay.settings import Source
from rig.run import execute
from rig.vision import Sighting

TICKS = 3000
RUNS = 5
STATES_PER_TICK = 5
TICKS_PER_IMAGE = 3
IMAGE = np.random.default_rng(0).normal(100.0, 2.0, (480, 640)).astype(np.uint8)


def main() -> None:
    """Print all figures."""
    with tempfile.TemporaryDirectory() as folder:
        for images in ("png", "jpeg", "off"):
            own, everything = handing_over(Path(folder), images)
            print(
                f"log.images {images:4}: {own:6.1f} µs a tick in the control loop's thread,", end=""
            )
            print(f" {everything - own:7.1f} µs in the log's")
        for images in ("png", "off"):
            for _ in range(2):
                own, everything, size = simulated(Path(folder), images)
            print(
                f"simulated run, images {images:3}: {1e3 * own:5.0f} ms of the loop's thread and",
                end="",
            )
            print(f" {1e3 * everything:5.0f} ms in all a simulated second; {size:5.1f} MB a minute")
        for source in ("features", "images"):
            speed = replaying(Path(folder) / "png", source)
            print(f"replay from {source:8}: {speed:.1f} times real time")


def handing_over(folder: Path, images: str) -> tuple[float, float]:
    """Processor µs per tick: of the thread that logs, and of the process; the median of runs."""
    costs = []
    for _ in range(RUNS):
        log = open_log(folder, images)
        own_s, all_s = time.thread_time(), time.process_time()
        with log:
            for tick in range(TICKS):
                one_tick(log, tick)
            own_s = time.thread_time() - own_s
        costs.append((1e6 * own_s / TICKS, 1e6 * (time.process_time() - all_s) / TICKS))
    return statistics.median(own for own, _ in costs), statistics.median(a for _, a in costs)


def open_log(folder: Path, images: str) -> RunLog:
    """A log on the wall clock."""
    config = load_config("sphere", None, [f"log.images={images}"])
    lens = Intrinsics(800.0, 800.0, 319.5, 239.5)
    return open_run_log(folder, LogHeader("sphere", config, lens, np.eye(4), True), WallClock())


def one_tick(log: RunLog, tick: int) -> None:
    """What a tick of a run logs."""
    t_s = 0.01 * tick
    twist, s = np.full(6, 0.0123456789), np.array([0.1234567, 0.2345678, 14.3456789])
    log.states([ArmState(t_s + 0.002 * k, np.eye(4), twist) for k in range(STATES_PER_TICK)])
    estimate = Estimate(t_s, s, None, 52.123456, None, 1e-4)
    if tick % TICKS_PER_IMAGE == 0:
        frame = Frame(IMAGE, t_s, 0.005, tick, "kernel")
        log.frame(Sighting(frame, Measurement(Feature(s, 1e-6 * np.eye(3)))), t_s)
        log.estimate("update", estimate)
    log.tick(t_s, 1e-5, 0)
    log.estimate("estimate", estimate)
    log.command(t_s, twist, twist, twist, ())


def simulated(folder: Path, images: str) -> tuple[float, float, float]:
    """Processor seconds per simulated second of the loop's thread and of all; MB a minute."""
    run_dir = folder / images
    run_dir.mkdir(exist_ok=True)
    config = load_config("sphere", None, ["sim.renderer=raster", f"log.images={images}"])
    own_s, all_s = time.thread_time(), time.process_time()
    summary = execute(config, "sphere", run_dir, False, QuietView(), lambda: False).summary
    own_s, all_s = time.thread_time() - own_s, time.process_time() - all_s
    sim_s, size = summary["sim_s"], summary["log_bytes"]
    assert isinstance(sim_s, float) and isinstance(size, int)
    return own_s / sim_s, all_s / sim_s, 60e-6 * size / sim_s


def replaying(run_dir: Path, source: Source) -> float:
    """Recorded seconds per processor second; the median of runs."""
    speeds = []
    for _ in range(RUNS + 1):
        start_s = time.process_time()
        summary = replay(open_recording(run_dir), [], source).summary
        assert isinstance(summary["sim_s"], float)
        speeds.append(summary["sim_s"] / (time.process_time() - start_s))
    return statistics.median(speeds[1:])


if __name__ == "__main__":
    main()
