"""The radius of a finished run and how far it can be trusted."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rig.recorded import RunRecord
from rig.records import Json

_SCATTER_OVER_S = 1.0

STATED = "one standard deviation, as the estimator states it"
JUDGED = (
    "the scatter of R̂ over the last second and what may be left of the first guess's error; "
    "this estimator states no deviation, and errors of the calibration are not in it"
)


@dataclass(frozen=True, slots=True)
class ErrorBar:
    """How far off the radius may be."""

    plus_minus_m: float
    meaning: str


def error_bar(record: RunRecord) -> ErrorBar | None:
    """The estimator's own deviation, or else one judged from the run; None without a radius."""
    summary = record.summary or {}
    if number(summary, "radius_m") is None or not record.data.updates:
        return None
    stated = number(summary, "radius_std_m")
    last = record.data.updates[-1]
    if stated is None and last.variance is not None and last.radius_m is not None:
        stated = float(np.sqrt(last.variance)) * last.radius_m**2  # dR = R² dχ
    if stated is not None:
        return ErrorBar(stated, STATED)
    return ErrorBar(_judged_m(record, number(summary, "transient_left") or 0.0), JUDGED)


def number(summary: Mapping[str, Json], key: str) -> float | None:
    """A figure of the summary; None where it is unknown."""
    value = summary.get(key)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _judged_m(record: RunRecord, left: float) -> float:
    """The transient has ``left`` of its start: R̂ has come 1 − left of its way from the guess."""
    updates = record.data.update_track()
    with np.errstate(divide="ignore"):
        radius_m = 1.0 / updates.chi
    late = updates.t_s >= updates.t_s[-1] - _SCATTER_OVER_S
    scatter_m = float(np.std(radius_m[late]))
    # A run hardly begun: all that is known is that the guess may be off by itself.
    left = min(left, 0.5)
    chi = updates.chi
    way = abs(float(chi[-1] - chi[0])) * left / (1.0 - left)
    return float(np.hypot(scatter_m, way * radius_m[-1] ** 2))
