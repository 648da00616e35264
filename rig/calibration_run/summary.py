"""A calibration in one object, and as a table."""

from pathlib import Path

import numpy as np
from rich.table import Table

from rig.calibration.result import CalibrationFile, Json


def json_of(
    delay: tuple[float, float], found: CalibrationFile, path: Path, wall_s: float
) -> dict[str, Json]:
    """What ``rig calibrate --json`` prints; None for what has not been calibrated.

    ``delay`` is from a picture's stamp to the program's having it, and its standard deviation.
    """
    lens, hand_eye, latency = found.intrinsics, found.hand_eye, found.latency
    verdict = found.verdict
    delay_s, delay_std_s = delay
    known = latency is not None and bool(np.isfinite(delay_s))
    rolling = latency is not None and latency.row_time_std_s > 0.0
    return {
        "rig": found.rig,
        "intrinsics": None
        if lens is None
        else {
            "fx": lens.fx_px,
            "fy": lens.fy_px,
            "cx": lens.cx_px,
            "cy": lens.cy_px,
            "distortion": list(lens.distortion),
            "std": {
                "fx": lens.std.fx_px,
                "fy": lens.std.fy_px,
                "cx": lens.std.cx_px,
                "cy": lens.std.cy_px,
                "distortion": list(lens.std.distortion),
            },
        },
        "hand_eye": None
        if hand_eye is None
        else {
            "T_tool_camera": [*hand_eye.tool_camera_xyz_m, *hand_eye.tool_camera_rotvec_rad],
            "std": [*hand_eye.std_xyz_m, *hand_eye.std_rotvec_rad],
        },
        # From mid-exposure to the program's having the image; what stamps are late by is apart.
        "latency_s": latency.latency_s + delay_s if latency is not None and known else None,
        "latency_std_s": float(np.hypot(latency.std_s, delay_std_s))
        if latency is not None and known
        else None,
        "stamp_late_s": None if latency is None else latency.latency_s,
        "row_time_s": latency.row_time_s if rolling and latency is not None else None,
        "row_time_std_s": latency.row_time_std_s if rolling and latency is not None else None,
        "held_out_px": None if hand_eye is None else hand_eye.held_out_px,
        "held_out_mm": None if hand_eye is None else hand_eye.held_out_mm,
        "held_out_deg": None if hand_eye is None else hand_eye.held_out_deg,
        "verdict": "missing" if verdict is None else "passed" if verdict.passed else "failed",
        "reasons": [] if verdict is None else list(verdict.reasons),
        "wall_s": wall_s,
        "file": str(path),
    }


def table(summary: dict[str, Json]) -> Table:
    """The result for a person."""
    out = Table(title=f"calibration of {summary['rig']}: {_in_words(summary)}", show_header=False)
    lens, hand_eye = summary["intrinsics"], summary["hand_eye"]
    if isinstance(lens, dict):
        std = lens["std"]
        for name in ("fx", "fy", "cx", "cy"):
            out.add_row(name, f"{lens[name]:.2f} ± {std[name]:.2f} px")
        out.add_row("distortion", " ".join(f"{value:.4f}" for value in lens["distortion"]))
    if isinstance(hand_eye, dict):
        values, stds = hand_eye["T_tool_camera"], hand_eye["std"]
        place = [f"{1e3 * v:.2f} ± {1e3 * s:.2f}" for v, s in zip(values, stds, strict=True)]
        turn = [
            f"{np.degrees(v):.3f} ± {np.degrees(s):.3f}" for v, s in zip(values, stds, strict=True)
        ]
        out.add_row("camera in the tool's frame", ", ".join(place[:3]) + " mm")
        out.add_row("  its rotation vector", ", ".join(turn[3:]) + " °")
    for key, name, factor, unit in (
        ("held_out_px", "held-out poses: image error", 1.0, "px"),
        ("held_out_mm", "  position error", 1.0, "mm"),
        ("held_out_deg", "  angle error", 1.0, "°"),
        ("latency_s", "latency, exposure to program", 1e3, "ms"),
        ("stamp_late_s", "  stamps are late by", 1e3, "ms"),
        ("latency_std_s", "  ±", 1e3, "ms"),
        ("row_time_s", "row to row", 1e6, "µs"),
        ("row_time_std_s", "  ±", 1e6, "µs"),
        ("wall_s", "took", 1.0, "s"),
    ):
        value = summary[key]
        if value is None and key.startswith("row_time"):
            continue  # not asked for
        out.add_row(name, f"{factor * value:.3f} {unit}" if isinstance(value, float) else "–")
    out.add_row("file", str(summary["file"]))
    return out


def _in_words(summary: dict[str, Json]) -> str:
    """The verdict; a calibration that only lacks steps has not failed."""
    reasons = summary["reasons"]
    missing = isinstance(reasons, list) and all(" is missing: " in str(one) for one in reasons)
    return "not complete" if summary["verdict"] == "failed" and missing else str(summary["verdict"])
