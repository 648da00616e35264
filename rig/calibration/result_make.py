"""From fits to the sections of the calibration file."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from rig.calibration import se3
from rig.calibration.hand_eye import HandEyeFit
from rig.calibration.intrinsics import IntrinsicsFit
from rig.calibration.latency import LatencyFit
from rig.calibration.result import (
    Fingerprints,
    HandEyeResult,
    IntrinsicsResult,
    IntrinsicsStd,
    LatencyResult,
    VerificationResult,
)
from rig.calibration.wiggle import WiggleVerdict

FloatArray = NDArray[np.float64]


def intrinsics_result(
    fit: IntrinsicsFit,
    size: tuple[int, int],
    depends_on: Fingerprints,
    refined: HandEyeFit | None = None,
) -> IntrinsicsResult:
    """The section for the camera; with ``refined``, the values that fit the arm's motion too."""
    found = fit.intrinsics if refined is None else refined.intrinsics
    std = fit.std if refined is None else refined.intrinsics_std
    how = f"{len(fit.used)} views, {fit.model.name}"
    if refined is not None:
        how += f"; refined with the arm's poses on {len(refined.used)} views"
    fx, fy, cx, cy, *distortion = (float(value) for value in std)
    return IntrinsicsResult(
        width=size[0],
        height=size[1],
        fx_px=found.fx_px,
        fy_px=found.fy_px,
        cx_px=found.cx_px,
        cy_px=found.cy_px,
        distortion=_five(found.distortion),
        std=IntrinsicsStd(fx_px=fx, fy_px=fy, cx_px=cx, cy_px=cy, distortion=_five(distortion)),
        obtained=how,
        fit_px=fit.rms_px,
        held_out_px=fit.held_out_px,
        coverage=fit.coverage.share,
        views=len(fit.used),
        rejected=fit.rejected_views,
        depends_on=depends_on,
    )


def hand_eye_result(fit: HandEyeFit, depends_on: Fingerprints) -> HandEyeResult:
    """The section for the hand-eye transform."""
    return HandEyeResult(
        tool_camera_xyz_m=_three(fit.T_tool_camera[:3, 3]),
        tool_camera_rotvec_rad=_three(se3.rotation_vectors(fit.T_tool_camera[:3, :3])),
        std_xyz_m=_three(fit.std_xyz_m),
        std_rotvec_rad=_three(fit.std_rotvec_rad),
        covariance=tuple(tuple(row) for row in fit.joint_covariance.tolist()),
        base_board_xyz_m=_three(fit.T_base_board[:3, 3]),
        base_board_rotvec_rad=_three(se3.rotation_vectors(fit.T_base_board[:3, :3])),
        obtained=f"{fit.start}, then least reprojection error over {len(fit.used)} poses",
        fit_px=fit.fit_px,
        held_out_px=fit.held_out.px,
        held_out_mm=fit.held_out.mm,
        held_out_deg=fit.held_out.deg,
        corner_px=fit.noise.corner_px,
        arm_m=fit.noise.arm_m,
        arm_rad=fit.noise.arm_rad,
        scale=fit.scale,
        scale_std=fit.scale_std,
        poses=len(fit.used),
        held_out_poses=len(fit.held_out_views),
        rejected=fit.rejected,
        depends_on=depends_on,
    )


def latency_result(fit: LatencyFit, depends_on: Fingerprints) -> LatencyResult:
    """The section for the latency."""
    frames = sum(part.frames for part in fit.segments)
    return LatencyResult(
        latency_s=fit.latency_s,
        std_s=fit.std_s,
        row_time_s=fit.row_time_s,
        row_time_std_s=fit.row_time_std_s,
        obtained=f"{len(fit.segments)} segments of a wiggle, {frames} images, "
        f"{fit.speed_px_s:.0f} px/s rms",
        segments_s=tuple(part.latency_s for part in fit.segments),
        correlation=fit.correlation,
        depends_on=depends_on,
    )


def verification_result(
    verdict: WiggleVerdict, depends_on: Fingerprints, fresh_px: float | None = None
) -> VerificationResult:
    """The section for the verification; ``fresh_px`` from poses looked from afterwards."""
    return VerificationResult(
        passed=verdict.passed,
        findings=verdict.findings,
        motions={one.axis: (one.motion_px, one.mismatch_px) for one in verdict.results},
        fresh_px=fresh_px,
        depends_on=depends_on,
    )


def intrinsics_of(result: IntrinsicsResult) -> Intrinsics:
    """The intrinsics as the estimator takes them."""
    r = result
    return Intrinsics(r.fx_px, r.fy_px, r.cx_px, r.cy_px, np.array(r.distortion))


def tool_camera_of(result: HandEyeResult) -> FloatArray:
    """T_tool_camera (4, 4)."""
    return se3.from_xyz_rotvec(
        np.array(result.tool_camera_xyz_m), np.array(result.tool_camera_rotvec_rad)
    )


def _three(values: FloatArray) -> tuple[float, float, float]:
    a, b, c = (float(value) for value in values)
    return a, b, c


def _five(values: FloatArray | Sequence[float]) -> tuple[float, float, float, float, float]:
    a, b, c, d, e = (float(value) for value in values)
    return a, b, c, d, e
