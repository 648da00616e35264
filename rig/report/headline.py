"""The radius of a finished run and how far it can be trusted."""

from dataclasses import dataclass

import numpy as np

from rig.recorded.record import RunRecord
from rig.report.texts import number
from rig.spread import left_m

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
    stated = last.radius_std_m if stated is None else stated
    if stated is not None:
        return ErrorBar(stated, STATED)
    return ErrorBar(_judged_m(record, number(summary, "transient_left") or 0.0), JUDGED)


def _judged_m(record: RunRecord, left: float) -> float:
    """The scatter of the last second, and the rest of the transient."""
    updates = record.data.update_track()
    with np.errstate(divide="ignore"):
        radius_m = 1.0 / updates.chi
    late = updates.t_s >= updates.t_s[-1] - _SCATTER_OVER_S
    scatter_m = float(np.std(radius_m[late]))
    chi = updates.chi
    return float(np.hypot(scatter_m, left_m(float(chi[-1]), float(chi[0]), left)))
