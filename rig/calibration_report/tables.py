"""A calibration's numbers in words."""

from collections.abc import Sequence

import numpy as np

from rig.calibration.result import CalibrationFile

Row = tuple[str, str]


def values(file: CalibrationFile) -> list[Row]:
    """What was found, each value with its standard deviation, and how well it predicts."""
    rows: list[Row] = []
    lens, place, late = file.intrinsics, file.hand_eye, file.latency
    if lens is not None:
        std = lens.std
        rows += [
            ("focal length", _pair(lens.fx_px, std.fx_px, lens.fy_px, std.fy_px, "px")),
            ("principal point", _pair(lens.cx_px, std.cx_px, lens.cy_px, std.cy_px, "px")),
            ("distortion k1, k2, p1, p2, k3", _each(lens.distortion, std.distortion, 1.0, 5)),
            ("held-out images", f"{lens.held_out_px:.3f} px rms"),
        ]
    if place is not None:
        turn, turn_std = place.tool_camera_rotvec_rad, place.std_rotvec_rad
        rows += [
            (
                "camera on the tool",
                _each(place.tool_camera_xyz_m, place.std_xyz_m, 1e3, 3) + " mm",
            ),
            (
                "its rotation vector",
                _each(turn, turn_std, float(np.degrees(1.0)), 4) + " °",
            ),
            (
                "held-out poses",
                f"{place.held_out_px:.3f} px, {place.held_out_mm:.3f} mm, "
                f"{place.held_out_deg:.4f}° rms",
            ),
            ("board's size by the arm", f"{place.scale:.5f} ± {place.scale_std:.5f} of its own"),
            ("noise of a corner", f"{place.corner_px:.3f} px"),
            ("scatter of the arm", f"{1e3 * place.arm_m:.3f} mm, {place.arm_rad:.1e} rad"),
        ]
    if late is not None:
        rows.append(("stamps late by", f"{1e3 * late.latency_s:.3f} ± {1e3 * late.std_s:.3f} ms"))
    check = file.verification
    if check is not None:
        rows += [
            (f"moving {axis}", f"{motion:.1f} px predicted, {off:.2f} px off")
            for axis, (motion, off) in check.motions.items()
        ]
        if check.fresh_px is not None:
            rows.append(("fresh poses", f"{check.fresh_px:.3f} px rms"))
    return rows


def details(file: CalibrationFile) -> list[Row]:
    """How each step got its result, what it left out, and what it holds for."""
    rows: list[Row] = []
    for name, part in (
        ("intrinsics", file.intrinsics),
        ("hand-eye", file.hand_eye),
        ("latency", file.latency),
    ):
        if part is not None:
            rows.append((name, part.obtained))
    for name, numbered in (("image", file.intrinsics), ("pose", file.hand_eye)):
        left_out = {} if numbered is None else numbered.rejected
        rows += [(f"{name} {i + 1} left out", why) for i, why in left_out.items()]
    check = file.verification
    rows += [("verification", finding) for finding in (() if check is None else check.findings)]
    board = file.board
    rows.append(
        (
            "board",
            f"{board.squares[0]} x {board.squares[1]} squares of {1e3 * board.square_m:g} mm, "
            f"markers of {1e3 * board.marker_m:g} mm, {board.dictionary}",
        )
    )
    if file.hand_eye is not None:
        depends = ", ".join(f"{key} {text}" for key, text in file.hand_eye.depends_on.items())
        rows.append(("holds for", depends))
    return rows


def _pair(a: float, a_std: float, b: float, b_std: float, unit: str) -> str:
    return f"{a:.3f} ± {a_std:.3f}, {b:.3f} ± {b_std:.3f} {unit}"


def _each(numbers: Sequence[float], stds: Sequence[float], factor: float, digits: int) -> str:
    pairs = zip(numbers, stds, strict=True)
    return ", ".join(f"{factor * v:.{digits}f} ± {factor * s:.{digits}f}" for v, s in pairs)
