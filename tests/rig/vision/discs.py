"""Recordings of a bright disc that moves a little, and vision processes that look at them."""

from pathlib import Path

import cv2
import numpy as np

from drivers.clock import Clock, WallClock
from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig
from rig.vision.messages import Job
from rig.vision.process import ProcessVision
from rig.vision.sighting import Sighting

INTRINSICS = Intrinsics(800.0, 800.0, 159.5, 119.5)
CLOCK = WallClock()
PATIENCE_S = 30.0


def disc(index: int) -> np.ndarray:
    """A disc of 40 px radius, ``index`` px right of the middle."""
    v, u = np.mgrid[:240, :320]
    share = np.clip(40.5 - np.hypot(u - 159.5 - index, v - 119.5), 0.0, 1.0)
    return np.rint(20.0 + 200.0 * share).astype(np.uint8)


def record(folder: Path, count: int) -> Path:
    """A folder of ``count`` pictures."""
    folder.mkdir()
    for index in range(count):
        cv2.imwrite(str(folder / f"{index}.png"), disc(index))
    return folder


def job(source: Path, loop: bool) -> Job:
    """What a run on that recording would ask the vision process for."""
    camera = {"driver": "opencv", "source": str(source), "rate_hz": 30.0, "loop": loop}
    tree = {"camera": camera, "arm": {"driver": "ur", "host": "127.0.0.1"}}
    return Job(RigConfig.model_validate(tree), "sphere", INTRINSICS)


def watch(source: Path, loop: bool, clock: Clock = CLOCK) -> ProcessVision:
    """A vision process on a recording."""
    return ProcessVision(job(source, loop), clock)


def poll_until_seen(vision: ProcessVision) -> list[Sighting]:
    """The first sightings."""
    deadline_s = CLOCK.now_s() + PATIENCE_S
    while CLOCK.now_s() < deadline_s:
        if seen := vision.poll():
            return seen
        CLOCK.sleep_until(CLOCK.now_s() + 0.005)
    raise AssertionError("no sighting came")


def poll_until_error(vision: ProcessVision, seen: list[Sighting]) -> None:
    """Collect sightings until ``poll`` raises."""
    deadline_s = CLOCK.now_s() + PATIENCE_S
    while CLOCK.now_s() < deadline_s:
        seen += vision.poll()
        CLOCK.sleep_until(CLOCK.now_s() + 0.005)
    raise AssertionError("no error came")
