"""The run in one object: what ``--json`` prints and the final table shows."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from rich.table import Table

from estimator.augmented import ExtraState
from rig.analysis import Analysis
from rig.calibration_limits import CalibrationLimits
from rig.config import STATING_VARIANCE, RigConfig, TargetKind
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
_PART_NAMES = {"hand_eye": "hand-eye", "focal_length": "focal length"}
_LEAST_SHOWN_M = 1e-7
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


def table(summary: Mapping[str, Json]) -> Table:
    """The final table."""
    out = Table(title=f"{summary['target']}: {summary['ending']}", show_header=False)
    position = summary["target_base_m"]
    where = "–"
    if isinstance(position, list):
        where = " ".join(_number(value, "{:.4f}") for value in position) + " m (base)"
    for name, value in [
        ("estimator", str(summary["estimator"])),
        ("radius", _radius(summary)),
        ("true radius", _number(summary["radius_true_m"], "{:.4f} mm", 1e3)),
        ("relative error", _number(summary["relative_error"], "{:+.3f} %", 1e2)),
        ("the calibration limits it to", _limits(summary)),
        ("position", where),
        *_progress(summary),
        *_found(summary),
        ("time to stay within ± 1 %", _number(summary["time_to_1pct_s"], "{:.2f} s")),
        *_servo(summary),
        (
            "frames",
            f"{summary['frames']} received, {summary['frames_lost']} without an outline, "
            f"{summary['frames_dropped']} dropped by the camera",
        ),
        ("ticks", f"{summary['ticks']}, {summary['overruns']} overruns"),
        ("tick lateness, 99 %", _number(summary["tick_late_p99_s"], "{:.3f} ms", 1e3)),
        ("scheduling", str(summary["scheduling"])),
        (
            "time",
            f"{_number(summary['sim_s'], '{:.2f} s')} of the rig in "
            f"{_number(summary['wall_s'], '{:.2f} s')}",
        ),
        ("renderer, seed", f"{summary['renderer'] or '–'}, {summary['seed']}"),
        ("log", _log(summary)),
        ("run directory", str(summary["run_dir"])),
    ]:
        out.add_row(name, value)
    return out


def _progress(summary: Mapping[str, Json]) -> list[tuple[str, str]]:
    """How far the estimate came, and how the paper's observer went along or would have."""
    rms = _number(summary["rms_vs_ideal"], "{:.3f} % of z(0)", 1e2)
    left = _number(summary["transient_left"], "{:.3f} %", 1e2)
    interval = f"± {left}" if summary["radius_std_m"] is not None else "no upper end"
    stated = summary["estimator"] in STATING_VARIANCE
    return [
        ("95 % interval", interval) if stated else ("transient left", left),
        (
            "rms from the ideal response",
            rms if summary["estimator"] == "observer" else f"{rms} (the paper's observer)",
        ),
    ]


def _servo(summary: Mapping[str, Json]) -> list[tuple[str, str]]:
    """How far the target ended from its wanted place, where there was one."""
    if summary["servo_error_px"] is None:
        return []
    off_m = _number(summary["servo_distance_error_m"], "{:+.2f} mm", 1e3)
    return [("servo error", f"{_number(summary['servo_error_px'], '{:.2f} px')}, {off_m}")]


def _found(summary: Mapping[str, Json]) -> list[tuple[str, str]]:
    """What the filter found besides the target, where it was asked to."""
    hidden = summary["not_observable"]
    rows = []
    for key, std, name, unit, factor, pattern in (
        ("time_offset_s", "time_offset_std_s", "time offset of the images", " ms", 1e3, "{:.2f}"),
        ("speed_scale", "speed_scale_std", "scale of the arm's speed", "", 1.0, "{:.4f}"),
    ):
        if summary[key] is not None:
            values = [_number(summary[k], pattern, factor) for k in (key, std)]
            seen = not (isinstance(hidden, list) and key.removesuffix("_s") in hidden)
            note = "" if seen else ", not observable in this run"
            rows.append((name, f"{values[0]} ± {values[1]}{unit}{note}"))
    return rows


def _log(summary: Mapping[str, Json]) -> str:
    """What was recorded, and what was not."""
    size = summary.get("log_bytes")
    if not isinstance(size, int):
        return "–"
    text = f"{size / 1e6:.1f} MB, {summary['images_recorded']} images"
    if summary["images_not_recorded"]:
        text += f", {summary['images_not_recorded']} dropped: writing was too slow"
    error = summary["log_error"]
    return text if error is None else f"{text}, ended early: {error}"


def _radius(summary: Mapping[str, Json]) -> str:
    """The radius with its standard deviation where the estimator states one."""
    radius = _number(summary["radius_m"], "{:.4f} mm", 1e3)
    std_m, total_m = summary["radius_std_m"], summary["radius_total_std_m"]
    if std_m is None:
        return radius
    stated = _number(std_m, "{:.4f} mm", 1e3)
    if total_m is None:
        return f"{radius} ± {stated} (1σ)"
    return f"{radius} ± {_number(total_m, '{:.4f} mm', 1e3)} (1σ, {stated} without calibration)"


def _limits(summary: Mapping[str, Json]) -> str:
    total_m, parts_m = (summary[f"radius_calibration_{key}_m"] for key in ("std", "parts"))
    if not isinstance(parts_m, Mapping):
        return "–"
    parts = [f"{_mm(std)} from {_PART_NAMES.get(name, name)}" for name, std in parts_m.items()]
    return f"{_mm(total_m)}: {', '.join(parts)}"


def _mm(std_m: Json) -> str:
    if not isinstance(std_m, float):
        return "–"
    return f"± {1e3 * std_m:.2g} mm" if std_m >= _LEAST_SHOWN_M else "less than ± 0.0001 mm"


def _number(value: Json, pattern: str, factor: float = 1.0) -> str:
    return pattern.format(value * factor) if isinstance(value, int | float) else "–"
