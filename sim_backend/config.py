"""What can be configured about the simulated rig, validated before anything is built."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from sim_backend.config_section import (
    Grey,
    NotNegative,
    Pose,
    Positive,
    Section,
    Vec3,
    check_direction,
)
from sim_backend.config_targets import (
    BoardConfig,
    CylinderConfig,
    CylinderObject,
    SphereConfig,
    SphereObject,
)

Coefficients = tuple[float, float, float, float, float]

# The renderers' margins around outlines take pixels for nearly square.
_MOST_ASPECT = 1.25


class LightConfig(Section):
    """One distant light and the ambient part of the illumination."""

    direction: Vec3 = (0.45, 0.3, 1.0)  # from the scene towards the light, in base; any length
    ambient: Annotated[float, Field(ge=0.0, le=1.0)] = 0.6


class BackgroundConfig(Section):
    """The floor at z = 0 of base: plain ``low_grey``, or texture between the two greys."""

    kind: Literal["plain", "texture"] = "texture"
    low_grey: Grey = 20.0
    high_grey: Grey = 60.0
    correlation_m: Positive = 0.012
    seed: Annotated[int, Field(ge=0)] = 7

    @model_validator(mode="after")
    def _ordered(self) -> "BackgroundConfig":
        if self.kind == "texture" and self.high_grey < self.low_grey:
            raise ValueError("background.high_grey must not be below background.low_grey")
        return self


class CameraConfig(Section):
    """The simulated camera and how it is mounted."""

    width: Annotated[int, Field(ge=16, le=4096)] = 640
    height: Annotated[int, Field(ge=16, le=4096)] = 480
    focal_px: Positive = 800.0  # of both axes, unless fx or fy says otherwise
    fx: Positive | None = None  # px; None: focal_px
    fy: Positive | None = None
    cx: float | None = None  # px, pixel centres at integers; None: the image's middle
    cy: float | None = None
    rate_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 30.0
    exposure_s: NotNegative = 0.004
    latency_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.040  # mid-exposure to readable
    latency_jitter_s: NotNegative = 0.003  # standard deviation, cut off at three of them
    # exposure: frames bear the instant of their mid-exposure. arrival: they bear it latency_s
    # late, as from a driver that cannot know; then calibration has something to find.
    stamps: Literal["exposure", "arrival"] = "exposure"
    noise_grey: Annotated[float, Field(ge=0.0, le=100.0)] = 2.0
    distortion: Coefficients = (0.0, 0.0, 0.0, 0.0, 0.0)  # k1, k2, p1, p2, k3
    vignetting: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0  # loss in the image's corner
    row_time_s: NotNegative = 0.0  # rolling shutter: from one row to the next
    drop_probability: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    max_sub_exposures: Annotated[int, Field(ge=1, le=256)] = 32

    @model_validator(mode="after")
    def _nearly_square_pixels(self) -> "CameraConfig":
        fx, fy = self.fx or self.focal_px, self.fy or self.focal_px
        if not 1 / _MOST_ASPECT <= fx / fy <= _MOST_ASPECT:
            raise ValueError(
                f"camera.fx = {fx:g} and camera.fy = {fy:g} differ too much: at most by a factor "
                f"of {_MOST_ASPECT:g} (camera.focal_px stands for the one that is left out)"
            )
        return self

    @model_validator(mode="after")
    def _exposures_do_not_overlap(self) -> "CameraConfig":
        period_s = 1.0 / self.rate_hz
        if self.exposure_s > period_s:
            raise ValueError(
                f"camera.exposure_s = {self.exposure_s:g} is longer than the frame period "
                f"{period_s:.4g} s (camera.rate_hz = {self.rate_hz:g})"
            )
        if self.row_time_s * (self.height - 1) > period_s:
            raise ValueError(
                f"camera.row_time_s = {self.row_time_s:g} makes the readout longer than the "
                f"frame period {period_s:.4g} s (camera.rate_hz = {self.rate_hz:g})"
            )
        return self


class FeatureConfig(Section):
    """How well images would show the target, where none are drawn (``level: features``)."""

    # Standard deviation of the outline's half-size; 0.002 is what clean images give, 0.01 hard
    # ones. What it is of all else follows from the geometry.
    noise_px: NotNegative = 0.002
    lost_probability: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    # Outliers have noise so many times as large, and do not say so.
    outlier_probability: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    outlier_size: NotNegative = 30.0


class ArmConfig(Section):
    """The gantry: its drives, its limits and what its controller reports."""

    slide_lag_s: Annotated[float, Field(ge=0.002, le=0.2)] = 0.020  # time constants of the drives
    wrist_lag_s: Annotated[float, Field(ge=0.002, le=0.2)] = 0.016
    max_slide_speed_m_s: Positive = 0.5
    max_wrist_speed_rad_s: Positive = 3.0
    max_slide_acceleration_m_s2: Positive = 2.0
    max_wrist_acceleration_rad_s2: Positive = 10.0
    report_delay_s: Annotated[float, Field(ge=0.0, le=0.1)] = 0.002
    encoder_step_m: NotNegative = 5e-6
    encoder_step_rad: NotNegative = 20e-6
    noise_m_s: NotNegative = 2e-4  # of each measured slide velocity
    noise_rad_s: NotNegative = 5e-4  # of each measured wrist velocity


class SimConfig(Section):
    """The whole simulated rig; every default is the rig of the paper."""

    seed: Annotated[int, Field(ge=0)] = 1
    renderer: Literal["auto", "gl", "raster"] = "auto"
    # features: no images at all; what measuring them would have found, with noise. For many runs.
    level: Literal["pixels", "features"] = "pixels"
    features: FeatureConfig = FeatureConfig()
    sphere: SphereConfig = SphereConfig()
    cylinder: CylinderConfig = CylinderConfig()
    board: BoardConfig = BoardConfig()
    # How the camera is bolted to the tool: its centre and axes in the tool frame.
    T_tool_camera: Pose = (0.03, -0.02, 0.06, 0.10, -0.08, 0.12)
    camera: CameraConfig = CameraConfig()
    arm: ArmConfig = ArmConfig()
    light: LightConfig = LightConfig()
    background: BackgroundConfig = BackgroundConfig()
    distractor_spheres: tuple[SphereObject, ...] = ()
    distractor_cylinders: tuple[CylinderObject, ...] = ()

    @model_validator(mode="after")
    def _targets_make_sense(self) -> "SimConfig":
        for name, target in (("sphere", self.sphere), ("cylinder", self.cylinder)):
            if 1.05 * target.radius_m >= target.start.distance_m:
                raise ValueError(
                    f"{name}.radius_m = {target.radius_m:g} leaves the camera inside the target: "
                    f"{name}.start.distance_m = {target.start.distance_m:g}"
                )
            if target.position_m[2] <= target.radius_m:
                raise ValueError(
                    f"{name}.position_m puts the target into the floor: its z must exceed "
                    f"{name}.radius_m = {target.radius_m:g}"
                )
        check_direction("cylinder.direction", self.cylinder.direction)
        check_direction("light.direction", self.light.direction)
        for i, extra in enumerate(self.distractor_cylinders):
            check_direction(f"distractor_cylinders.{i}.direction", extra.direction)
        return self
