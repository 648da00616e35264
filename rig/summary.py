"""The run in one object: what ``--json`` prints."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from estimator.augmented import ExtraState
from rig.analysis import Analysis
from rig.calibration_limits import CalibrationLimits
from rig.config import RigConfig, TargetKind
from rig.outcome import Ending, RunOutcome
from rig.records import Json

# What `rig run --json` prints, in this order; summary.json holds more.
JSON_KEYS = (
    "target",
    "estimator",
    "radius_m",
    "radius_true_m",
    "relative_error",
    "radius_calibration_std_m",
    "radius_calibration_parts_m",
    "radius_total_std_m",
    "rms_vs_ideal",
    "time_to_1pct_s",
    "servo_error_px",
    "servo_distance_error_m",
    "radius_std_m",
    "nees",
    "time_offset_s",
    "time_offset_std_s",
    "speed_scale",
    "speed_scale_std",
    "frames",
    "frames_lost",
    "ticks",
    "overruns",
    "tick_late_p99_s",
    "sim_s",
    "wall_s",
    "renderer",
    "seed",
    "run_dir",
)
_WITH_RADIUS = (Ending.TIME, Ending.CONVERGED, Ending.INTERRUPTED)


def radius_obtained(outcome: RunOutcome, analysis: Analysis) -> float | None:
    """The final radius, or None when the run gave none that may be used."""
    if outcome.ending not in _WITH_RADIUS or len(analysis.radius_m) == 0:
        return None
    if not outcome.target_state.startswith("tracking"):
        return None
    radius_m = float(analysis.radius_m[-1])
    return radius_m if np.isfinite(radius_m) and radius_m > 0 else None


def summarise(
    target: TargetKind,
    outcome: RunOutcome,
    analysis: Analysis,
    config: RigConfig,
    renderer: str | None,
    wall_s: float,
    run_dir: Path,
) -> dict[str, Json]:
    """All figures of a run; None where a figure is unknown or was not reached."""
    radius_m = radius_obtained(outcome, analysis)
    position = None if analysis.target_m is None or radius_m is None else analysis.target_m.tolist()
    run_s = outcome.ended_s - outcome.started_s
    return {
        "target": target,
        "estimator": config.estimator.chosen,
        "radius_m": radius_m,
        "radius_true_m": analysis.radius_true_m,
        "relative_error": None if radius_m is None else analysis.relative_error,
        **limits_of(None),
        "rms_vs_ideal": analysis.rms_vs_ideal,
        "time_to_1pct_s": analysis.time_to_1pct_s,
        "servo_error_px": None,
        "servo_distance_error_m": None,
        "radius_std_m": None if radius_m is None else outcome.data.updates[-1].radius_std_m,
        "nees": None if radius_m is None else analysis.nees,
        **_extra(outcome.data.extra_states()),
        "frames": outcome.data.frames,
        "frames_lost": outcome.data.frames_lost,
        "ticks": outcome.stats.ticks,
        "overruns": outcome.stats.overruns,
        "tick_late_p99_s": outcome.stats.late_p99_s(),
        "sim_s": run_s,
        "wall_s": wall_s,
        "renderer": renderer,
        "seed": config.sim.seed,
        "run_dir": str(run_dir),
        "ending": outcome.ending.value,
        "error": None if outcome.error is None else str(outcome.error),
        "target_state": outcome.target_state,
        "not_observable": [x.name for x in outcome.data.extra_states() if not x.observable],
        "doubts": outcome.data.doubts(),
        "radius_bound_m": analysis.radius_bound_m,
        "holds": outcome.holds,
        "last_hold": outcome.last_hold,
        "arm_at_rest": outcome.at_rest,
        "frames_dropped": outcome.data.frames_dropped,
        "transient_left": outcome.remaining_fraction,
        "scheduling": outcome.stats.scheduling,
        "tick_late_median_s": outcome.stats.late_median_s(),
        "tick_late_max_s": outcome.stats.late_max_s(),
        "target_base_m": position,
    }


def _extra(states: Sequence[ExtraState]) -> dict[str, Json]:
    """The optional states and their deviations; None where they were not asked for."""
    known = {state.name: state for state in states}
    out: dict[str, Json] = {}
    for name, unit in (("time_offset", "_s"), ("speed_scale", "")):
        state = known.get(name)
        out[name + unit] = None if state is None else state.value
        out[f"{name}_std{unit}"] = None if state is None else state.std
    return out


def limits_of(limits: CalibrationLimits | None, std_m: float | None = None) -> dict[str, Json]:
    """What the calibration limits the radius to; None where its deviations are not known.

    The total joins to that what the estimator states, ``std_m``.
    """
    total_m = None
    if limits is not None and std_m is not None:
        total_m = math.hypot(limits.total_m, std_m)
    return {
        "radius_total_std_m": total_m,
        "radius_calibration_std_m": None if limits is None else limits.total_m,
        "radius_calibration_parts_m": None if limits is None else dict(limits.parts_m),
    }
