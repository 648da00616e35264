"""The calibration section: what is known before, the board, how to calibrate, the result."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rig.calibration.board import BoardConfig
from rig.calibration.hand_eye import HandEyeSettings
from rig.calibration.pose_candidates import PoseLimits, StartDoubt
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
    doubt: StartDoubt = StartDoubt()  # how far the values to start from may be off


def _check_whole(xyz_m: object, rotvec_rad: object) -> None:
    if (xyz_m is None) != (rotvec_rad is None):
        raise ValueError("tool_camera_xyz_m and tool_camera_rotvec_rad go together: give both")


class NominalConfig(Section):
    """What `rig calibrate` starts from, and `rig run --uncalibrated` uses; nothing else does.

    A rough place on the tool is enough: 2 cm, 10°. Without intrinsics a common lens is assumed.
    """

    intrinsics: IntrinsicsConfig | None = None
    tool_camera_xyz_m: tuple[Finite, Finite, Finite] | None = None
    tool_camera_rotvec_rad: tuple[Finite, Finite, Finite] | None = None
    latency_s: Finite | None = None

    @model_validator(mode="after")
    def _hand_eye_whole(self) -> Self:
        _check_whole(self.tool_camera_xyz_m, self.tool_camera_rotvec_rad)
        return self


class CalibrationConfig(Section):
    """What is known about the rig's geometry; left out, a simulated rig's factory values hold.

    ``intrinsics`` to ``latency_s`` are for values that were measured elsewhere: a run trusts
    them, of a real rig only if ``obtained`` says how. With a calibration's file a run takes all
    of them from there; with ``file`` (relative to the rig file) it needs one.
    """

    file: str | None = None
    nominal: NominalConfig = NominalConfig()
    obtained: Annotated[str, Field(min_length=1)] | None = None
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
        _check_whole(self.tool_camera_xyz_m, self.tool_camera_rotvec_rad)
        if self.row_time_s != 0.0 and self.intrinsics is None and self.file is None:
            raise ValueError("row_time_s goes with intrinsics: give both")
        return self
