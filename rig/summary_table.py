"""A run's figures in words: the table at its end."""

from collections.abc import Mapping

from rich.table import Table

from rig.config import STATING_VARIANCE
from rig.records import Json

_PART_NAMES = {"hand_eye": "hand-eye", "focal_length": "focal length"}
_LEAST_SHOWN_M = 1e-7


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
