"""The calibration section: nominal values, the board, how to calibrate, and where the result is."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rig.calibration.board import BoardConfig
from rig.calibration.hand_eye import HandEyeSettings
from rig.calibration.pose_candidates import PoseLimits
from rig.calibration.result_check import Requirements
from rig.config_section import Finite, Positive, Section


class IntrinsicsConfig(Section):
    """Pinhole with Brown-Conrady distortion; pixel centres at integer coordinates."""

    fx_px: Positive
    fy_px: Positive
    cx_px: Finite
    cy_px: Finite
    distortion: tuple[Finite, Finite, Finite, Finite, Finite] = (0.0, 0.0, 0.0, 0.0, 0.0)
    # Width and height of the images they hold for; of another size, none is accepted.
    image_size_px: tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]] | None = None


class PlanConfig(Section):
    """What `rig calibrate` collects."""

    poses: Annotated[int, Field(ge=10, le=200)] = 30
    verify_poses: Annotated[int, Field(ge=2, le=50)] = 4
    segments: Annotated[int, Field(ge=2, le=10)] = 2  # of wiggling, for the latency
    segment_s: Annotated[float, Field(ge=3, le=60)] = 5.0
    rolling_shutter: bool = False  # find the time from row to row too, from the same wiggles
    speed: Annotated[float, Field(gt=0, le=1)] = 0.7  # share of the safety section's speeds
    limits: PoseLimits = PoseLimits()
    hand_eye: HandEyeSettings = HandEyeSettings()


class CalibrationConfig(Section):
    """What is known about the rig's geometry; left out, the device's own factory values hold.

    With ``file`` (relative to the working directory) a run needs the result of `rig calibrate`
    and takes everything from there; the values here are then only what calibrating starts from.
    """

    file: str | None = None
    intrinsics: IntrinsicsConfig | None = None
    tool_camera_xyz_m: tuple[Finite, Finite, Finite] | None = None
    tool_camera_rotvec_rad: tuple[Finite, Finite, Finite] | None = None
    # The arm's TCP (x, y, z in m, rotation vector in rad) that the transform above holds for;
    # where the arm tells another one, a run refuses.
    tcp_offset: tuple[Finite, Finite, Finite, Finite, Finite, Finite] | None = None
    latency_s: Finite = 0.0  # by which the images' stamps are late
    row_time_s: Finite = 0.0  # by which each row of an image is exposed after the one above it
    board: BoardConfig = BoardConfig()
    plan: PlanConfig = PlanConfig()
    required: Requirements = Requirements()

    @model_validator(mode="after")
    def _what_goes_together(self) -> Self:
        if (self.tool_camera_xyz_m is None) != (self.tool_camera_rotvec_rad is None):
            raise ValueError("tool_camera_xyz_m and tool_camera_rotvec_rad go together: give both")
        if self.row_time_s != 0.0 and self.intrinsics is None and self.file is None:
            raise ValueError("row_time_s goes with intrinsics: give both")
        return self
