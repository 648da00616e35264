"""Whether a calibration may be used: complete, good enough, and of the rig as it is now."""

from pathlib import Path

from rig.calibration.errors import UnusableCalibrationError
from rig.calibration.result import (
    CalibrationFile,
    Fingerprints,
    HandEyeResult,
    IntrinsicsResult,
    LatencyResult,
    Verdict,
    VerificationResult,
)
from rig.config_section import Positive, Section

_Part = IntrinsicsResult | HandEyeResult | LatencyResult | VerificationResult | None

_STEPS = ("intrinsics", "hand-eye", "latency", "verification")
_COMMANDS = ("intrinsics", "hand-eye", "latency", "verify")
# What a change of each part means to a user.
_CHANGED = {
    "camera": "the camera's mode or controls changed",
    "tcp": "the tool centre point set on the arm changed",
    "board": "the board's definition changed",
    "arm": "the arm or its kinematics changed",
    "intrinsics": "the intrinsics were calibrated anew",
    "hand_eye": "the hand-eye transform was calibrated anew",
}


class Requirements(Section):
    """What a calibration must reach to be used without asking."""

    max_held_out_px: Positive = 0.5
    max_held_out_mm: Positive = 2.0
    max_held_out_deg: Positive = 0.5
    max_focal_std: Positive = 0.003  # of the focal length
    max_std_m: Positive = 0.002  # of the camera's place on the tool, per axis
    max_std_rad: Positive = 0.005
    max_latency_std_s: Positive = 0.001


def judge(calibration: CalibrationFile, required: Requirements | None = None) -> Verdict:
    """What is missing or not good enough, each reason with the step to repeat."""
    need = required or Requirements()
    reasons: list[str] = []
    for name, command, part in zip(_STEPS, _COMMANDS, _parts(calibration), strict=True):
        if part is None:
            reasons.append(f"{name} is missing: run `rig calibrate {command}`")
    inner, hand_eye, latency = calibration.intrinsics, calibration.hand_eye, calibration.latency
    if inner is not None:
        focal = max(inner.std.fx_px / inner.fx_px, inner.std.fy_px / inner.fy_px)
        reasons += _over(
            "the focal length's deviation", focal, need.max_focal_std, "of it", "intrinsics"
        )
        reasons += _over(
            "image error on held-out images",
            inner.held_out_px,
            need.max_held_out_px,
            "px",
            "intrinsics",
        )
    if hand_eye is not None:
        for what, value, bound, unit in (
            ("image error on held-out poses", hand_eye.held_out_px, need.max_held_out_px, "px"),
            ("position error on held-out poses", hand_eye.held_out_mm, need.max_held_out_mm, "mm"),
            ("angle error on held-out poses", hand_eye.held_out_deg, need.max_held_out_deg, "°"),
            ("the deviation of the camera's place", max(hand_eye.std_xyz_m), need.max_std_m, "m"),
            (
                "the deviation of the camera's attitude",
                max(hand_eye.std_rotvec_rad),
                need.max_std_rad,
                "rad",
            ),
        ):
            reasons += _over(what, value, bound, unit, "hand-eye")
    if latency is not None:
        reasons += _over(
            "the latency's deviation", latency.std_s, need.max_latency_std_s, "s", "latency"
        )
    check = calibration.verification
    if check is not None and not check.passed:
        first = check.findings[0] if check.findings else "see its report"
        reasons.append(f"the verification failed ({first}): put it right, then `rig calibrate`")
    return Verdict(passed=not reasons, reasons=tuple(reasons))


def stale(calibration: CalibrationFile, now: Fingerprints) -> list[str]:
    """What changed since each step, with the step to repeat; ``now`` are today's fingerprints.

    A part that ``now`` does not name cannot be told and is not held against the file.
    """
    reasons = []
    for name, command, part in zip(_STEPS, _COMMANDS, _parts(calibration), strict=True):
        for key, then in ({} if part is None else part.depends_on).items():
            if key in now and now[key] != then:
                why = _CHANGED.get(key, f"{key} changed")
                reasons.append(f"{why} since {name}: run `rig calibrate {command}` again")
    return reasons


def check_usable(calibration: CalibrationFile, now: Fingerprints, path: Path) -> None:
    """Raise UnusableCalibrationError unless the file passed its verdict and fits the rig now."""
    verdict = judge(calibration) if calibration.verdict is None else calibration.verdict
    reasons = [*verdict.reasons, *stale(calibration, now)]
    if not verdict.passed and not reasons:
        reasons = ["its verdict is negative: run `rig calibrate` again"]
    if reasons:
        raise UnusableCalibrationError(
            f"the calibration {path} may not be used: {'; '.join(reasons)} "
            "(or run with --uncalibrated, on the nominal values)"
        )


def _parts(calibration: CalibrationFile) -> tuple[_Part, ...]:
    return (
        calibration.intrinsics,
        calibration.hand_eye,
        calibration.latency,
        calibration.verification,
    )


def _over(what: str, value: float, bound: float, unit: str, command: str) -> list[str]:
    if value <= bound:
        return []
    return [
        f"{what}: {value:.3g} {unit}, at most {bound:.3g} is allowed: "
        f"run `rig calibrate {command}` again"
    ]
