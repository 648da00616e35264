"""How well a run kept its time, from its record: lateness, latency, drops."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.recorded.record import RunRecord

FloatArray = NDArray[np.float64]


def tick_lateness_s(record: RunRecord) -> FloatArray:
    """(n,) How late each tick began after its point on the control grid."""
    return np.array([tick.late_s for tick in record.ticks], dtype=np.float64)


def image_latency_s(record: RunRecord) -> tuple[FloatArray, FloatArray]:
    """(k,) Handling times, and the age of each image's exposure by then."""
    handled_s = np.array([frame.handled_s for frame in record.frames])
    stamps_s = np.array([frame.t_s for frame in record.frames])
    return handled_s, handled_s - (stamps_s - record.config.calibration.latency_s)


def dropped_at_s(record: RunRecord) -> list[tuple[float, int]]:
    """When images were missing in the camera's sequence, and how many."""
    return [
        (after.handled_s, after.seq - before.seq - 1)
        for before, after in pairwise(record.frames)
        if after.seq - before.seq > 1
    ]
