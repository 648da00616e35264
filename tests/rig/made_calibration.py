"""A calibration file as `rig calibrate` might have written it, with plain values."""

from rig.calibration.board import BoardConfig
from rig.calibration.result import (
    CalibrationFile,
    HandEyeResult,
    IntrinsicsResult,
    IntrinsicsStd,
    LatencyResult,
    Verdict,
)
from rig.config import RigConfig
from rig.fingerprints import fingerprints


def calibration_of(rig: RigConfig, passed: bool = True) -> CalibrationFile:
    now = fingerprints(rig)
    zero = (0.0, 0.0, 0.0)
    return CalibrationFile(
        rig=rig.name,
        made="2026-01-01",
        board=BoardConfig(),
        intrinsics=IntrinsicsResult(
            width=640,
            height=480,
            fx_px=790.0,
            fy_px=791.0,
            cx_px=320.0,
            cy_px=240.0,
            distortion=(0.01, 0.0, 0.0, 0.0, 0.0),
            std=IntrinsicsStd(fx_px=0.1, fy_px=0.1, cx_px=0.1, cy_px=0.1, distortion=(0.0,) * 5),
            obtained="by hand",
            fit_px=0.1,
            held_out_px=0.1,
            coverage=1.0,
            views=10,
            depends_on=now,
        ),
        hand_eye=HandEyeResult(
            tool_camera_xyz_m=(0.01, 0.02, 0.03),
            tool_camera_rotvec_rad=(0.1, 0.2, 0.3),
            std_xyz_m=zero,
            std_rotvec_rad=zero,
            base_board_xyz_m=zero,
            base_board_rotvec_rad=zero,
            obtained="by hand",
            fit_px=0.1,
            held_out_px=0.1,
            held_out_mm=0.1,
            held_out_deg=0.1,
            corner_px=0.1,
            arm_m=0.0,
            arm_rad=0.0,
            scale=1.0,
            scale_std=0.001,
            poses=10,
            held_out_poses=2,
            depends_on=now,
        ),
        latency=LatencyResult(
            latency_s=0.05,
            std_s=1e-4,
            obtained="by hand",
            segments_s=(0.05, 0.05),
            correlation=1.0,
            depends_on=now,
        ),
        verdict=Verdict(passed=passed, reasons=() if passed else ("held-out error",)),
    )
