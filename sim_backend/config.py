"""What can be configured about the simulated rig, validated before anything is built."""

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

Vec3 = tuple[float, float, float]
Grey = Annotated[float, Field(ge=0.0, le=255.0)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Tilt = Annotated[float, Field(ge=-75.0, le=75.0)]
Coefficients = tuple[float, float, float, float, float]


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class StartPose(_Section):
    """Where the camera starts, seen from the target.

    The camera first looks straight down with its x along base x; it is then tilted about base
    x, about base y, spun about its optical axis, and moved so that the target's reference
    point lies ``distance_m`` from the camera's centre and ``offset_px`` from the principal
    point (before lens distortion).
    """

    distance_m: Positive
    tilt_x_deg: Tilt = 0.0
    tilt_y_deg: Tilt = 0.0
    spin_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 0.0
    offset_px: tuple[float, float] = (0.0, 0.0)


class SphereStart(StartPose):
    """By default an orbit along −x of the camera at 0.05 m/s passes over the top in 3 s."""

    distance_m: Positive = 0.27
    tilt_x_deg: Tilt = 6.0
    tilt_y_deg: Tilt = 32.0
    offset_px: tuple[float, float] = (14.0, -9.0)


class CylinderStart(StartPose):
    """By default 6 s of approaching at 0.06 m/s end 0.2 m from the axis."""

    distance_m: Positive = 0.55
    offset_px: tuple[float, float] = (10.0, -12.0)


class SphereConfig(_Section):
    """The spherical target."""

    radius_m: Positive = 0.019
    albedo_grey: Grey = 225.0
    position_m: Vec3 = (0.0, 0.0, 0.30)  # centre, in base
    start: SphereStart = SphereStart()


class CylinderConfig(_Section):
    """The cylindrical target; by default its axis lies at 60° in the image, towards +x, +y."""

    radius_m: Positive = 0.042
    albedo_grey: Grey = 225.0
    position_m: Vec3 = (0.0, 0.0, 0.30)  # middle of the axis, in base
    direction: Vec3 = (0.5, -0.8660254037844386, 0.0)  # of the axis, in base; any length
    length_m: Positive = 1.2
    start: CylinderStart = CylinderStart()


class SphereObject(_Section):
    """A further sphere in view."""

    radius_m: Positive
    position_m: Vec3
    albedo_grey: Grey = 160.0


class CylinderObject(_Section):
    """A further cylinder in view, with flat ends."""

    radius_m: Positive
    position_m: Vec3
    direction: Vec3
    length_m: Positive
    albedo_grey: Grey = 160.0


class LightConfig(_Section):
    """One distant light and the ambient part of the illumination."""

    direction: Vec3 = (0.45, 0.3, 1.0)  # from the scene towards the light, in base; any length
    ambient: Annotated[float, Field(ge=0.0, le=1.0)] = 0.6


class BackgroundConfig(_Section):
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


class CameraConfig(_Section):
    """The simulated camera and how it is mounted."""

    width: Annotated[int, Field(ge=16, le=4096)] = 640
    height: Annotated[int, Field(ge=16, le=4096)] = 480
    focal_px: Positive = 800.0
    principal_point_px: tuple[float, float] | None = None  # None: the image's middle
    rate_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 30.0
    exposure_s: NotNegative = 0.004
    latency_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.040  # mid-exposure to readable
    latency_jitter_s: NotNegative = 0.003  # standard deviation, cut off at three of them
    noise_grey: Annotated[float, Field(ge=0.0, le=100.0)] = 2.0
    distortion: Coefficients = (0.0, 0.0, 0.0, 0.0, 0.0)  # k1, k2, p1, p2, k3
    vignetting: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0  # loss in the image's corner
    row_time_s: NotNegative = 0.0  # rolling shutter: from one row to the next
    drop_probability: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    max_sub_exposures: Annotated[int, Field(ge=1, le=256)] = 32
    mount_xyz_m: Vec3 = (0.03, -0.02, 0.06)  # the camera's centre in the tool frame
    mount_rotvec_rad: Vec3 = (0.10, -0.08, 0.12)

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


class ArmConfig(_Section):
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


class SimConfig(_Section):
    """The whole simulated rig; every default is the rig of the paper."""

    seed: Annotated[int, Field(ge=0)] = 1
    renderer: Literal["auto", "gl", "raster"] = "auto"
    sphere: SphereConfig = SphereConfig()
    cylinder: CylinderConfig = CylinderConfig()
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
        _check_direction("cylinder.direction", self.cylinder.direction)
        _check_direction("light.direction", self.light.direction)
        for i, extra in enumerate(self.distractor_cylinders):
            _check_direction(f"distractor_cylinders.{i}.direction", extra.direction)
        return self


def _check_direction(key: str, direction: Vec3) -> None:
    if float(np.linalg.norm(direction)) < 1e-9:
        raise ValueError(f"{key} must not be the zero vector")
