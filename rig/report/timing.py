"""How well a run kept its time, from its record: lateness, latency, drops."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.recorded import RunRecord

FloatArray = NDArray[np.float64]

_BINS = 100
_GAP = 0.05  # of the period without a tick: the bunch ends here


def tick_lateness_s(record: RunRecord) -> FloatArray:
    """(n,) How late each tick began after its point on the control grid.

    The grid's origin is not recorded. Most ticks begin within a small part of the period, so
    that it is found as the lower end of that bunch.
    """
    t_s = np.array([command.t_s for command in record.commands])
    if len(t_s) == 0:
        return t_s
    period_s = 1.0 / record.config.run.control_rate_hz
    phases_s = np.mod(t_s - t_s[0], period_s)
    counts, edges_s = np.histogram(phases_s, _BINS, (0.0, period_s))
    top_s = edges_s[int(np.argmax(counts)) + 1]
    below_s = np.sort(np.mod(top_s - phases_s, period_s))
    gaps = np.flatnonzero(np.diff(below_s) > _GAP * period_s)
    lowest_s = below_s[gaps[0]] if len(gaps) else below_s[-1]
    late_s: FloatArray = np.mod(phases_s - (top_s - lowest_s), period_s)
    # What rounding left on the other side of the origin.
    late_s[late_s > period_s * (1.0 - 1e-6)] = 0.0
    return late_s


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
