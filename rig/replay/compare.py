"""Whether a replay says what the run said, to the last bit."""

from itertools import zip_longest

import numpy as np

from estimator.estimate import Estimate
from rig.replay.engine import Kept

# Written after what they come from: a log that was cut off may lack these of its last tick.
_CUT_OFF = 2


def first_difference(recorded: Kept, replayed: Kept, cut_off: bool = False) -> str:
    """Where the two part, in words; "" when every bit is the same.

    Of a log that is ``cut_off``, what the last tick would have recorded may be missing.
    """
    for name, a, b in (
        ("update", recorded.updates, replayed.updates),
        ("prediction", recorded.predictions, replayed.predictions),
    ):
        missing = len(b) - len(a)
        if cut_off and 0 < missing <= _CUT_OFF:
            b = b[: len(a)]
        for number, (one, other) in enumerate(zip_longest(a, b)):
            if one is None or other is None:
                return f"{len(a)} {name}s were recorded, {len(b)} come from the replay"
            if not _same(one, other):
                return (
                    f"{name} {number} at {one.t_s:.6f} s: recorded 1/R = {one.chi!r}, s = "
                    f"{one.s.tolist()}, replayed {other.chi!r}, {other.s.tolist()}"
                )
    return ""


def _same(one: Estimate, other: Estimate) -> bool:
    if (one.axis is None) != (other.axis is None):
        return False
    if one.axis is not None and other.axis is not None and not _equal(one.axis, other.axis):
        return False
    if one.doubt != other.doubt:
        return False
    # Recorded of updates only: a prediction's follow from them.
    if one.covariance is not None and not _equal(one.covariance, other.covariance):
        return False
    return _equal(_numbers(one), _numbers(other))


def _numbers(estimate: Estimate) -> np.ndarray:
    variance = np.nan if estimate.variance is None else estimate.variance
    numbers = (estimate.t_s, estimate.chi, estimate.residual, estimate.extrapolated_s, variance)
    return np.array([*numbers, *estimate.s])


def _equal(one: np.ndarray, other: np.ndarray | None) -> bool:
    return other is not None and bool(np.array_equal(one, other, equal_nan=True))
