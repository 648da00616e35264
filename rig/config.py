"""The rig's configuration: one validated, frozen tree; every key names its unit."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from rig.config_devices import ArmConfig, CameraConfig, SimArm, SimCamera
from rig.config_section import Finite, NotNegative, Positive, Section
from sim_backend.config import SimConfig

TargetKind = Literal["sphere", "cylinder"]


class IntrinsicsConfig(Section):
    """Pinhole with Brown-Conrady distortion; pixel centres at integer coordinates."""

    fx_px: Positive
    fy_px: Positive
    cx_px: Finite
    cy_px: Finite
    distortion: tuple[Finite, Finite, Finite, Finite, Finite] = (0.0, 0.0, 0.0, 0.0, 0.0)


class CalibrationConfig(Section):
    """What is known about the rig's geometry; left out, the device's own factory values hold."""

    intrinsics: IntrinsicsConfig | None = None
    tool_camera_xyz_m: tuple[Finite, Finite, Finite] | None = None
    tool_camera_rotvec_rad: tuple[Finite, Finite, Finite] | None = None

    @model_validator(mode="after")
    def _hand_eye_whole(self) -> Self:
        if (self.tool_camera_xyz_m is None) != (self.tool_camera_rotvec_rad is None):
            raise ValueError("tool_camera_xyz_m and tool_camera_rotvec_rad go together: give both")
        return self


class EstimatorConfig(Section):
    """The observer's gains and its first guess."""

    kind: Literal["observer"] = "observer"
    alpha: Annotated[float, Field(gt=0, le=1e6)] = 2000.0
    damping: Annotated[float, Field(gt=0, le=20)] = 1.0  # multiple of c* = 2 sqrt(alpha) sigma
    radius_guess_m: Annotated[float, Field(gt=0, le=10)] = 0.03


class MotionConfig(Section):
    """How the camera moves, in its own axes."""

    policy: Literal["constant", "paper"] = "constant"
    velocity_m_s: tuple[Finite, Finite, Finite] = (-0.05, 0.0, 0.0)
    k1: NotNegative = 10.0  # eq. (24): holds the norm of v
    k2: NotNegative = 1.0  # eq. (24): turns v towards the largest sigma1²
    centring_gain_per_s: Annotated[float, Field(gt=0, le=10)] = 5.0


class SafetyConfig(Section):
    """The envelope no command leaves; limits of the tool, in the base frame where directed."""

    max_linear_speed_m_s: Positive = 0.15
    max_angular_speed_rad_s: Positive = 1.0
    max_linear_acceleration_m_s2: Positive = 1.0
    max_angular_acceleration_rad_s2: Positive = 5.0
    workspace_min_m: tuple[Finite, Finite, Finite] = (-2.0, -2.0, 0.05)
    workspace_max_m: tuple[Finite, Finite, Finite] = (2.0, 2.0, 2.0)
    # A frame older than this is not acted upon: the arm ramps to rest until a new one comes.
    max_feature_age_s: Positive = 0.3
    # Resting without a target for this long ends the run.
    target_lost_after_s: Positive = 2.0
    max_state_age_s: Positive = 0.1

    @model_validator(mode="after")
    def _box_not_empty(self) -> Self:
        if any(lo >= hi for lo, hi in zip(self.workspace_min_m, self.workspace_max_m, strict=True)):
            raise ValueError("workspace_min_m must lie below workspace_max_m on every axis")
        return self


class RunConfig(Section):
    """How long a run lasts and how fast it ticks."""

    duration_s: Annotated[float, Field(gt=0, le=3600)] = 6.0
    control_rate_hz: Annotated[float, Field(ge=10, le=1000)] = 100.0
    until_converged: bool = False
    # Converged: the predicted rest of the transient and the drift of R over the last second
    # are both below this fraction.
    converged_fraction: Annotated[float, Field(gt=0, lt=1)] = 0.002


class RigConfig(Section):
    """Everything a run depends on."""

    name: str = "sim"
    camera: CameraConfig = SimCamera()
    arm: ArmConfig = SimArm()
    calibration: CalibrationConfig = CalibrationConfig()
    estimator: EstimatorConfig = EstimatorConfig()
    motion: MotionConfig = MotionConfig()
    safety: SafetyConfig = SafetyConfig()
    run: RunConfig = RunConfig()
    sim: SimConfig = SimConfig()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        speed_m_s = float(np.linalg.norm(self.motion.velocity_m_s))
        if speed_m_s == 0.0:
            raise ValueError("motion.velocity_m_s is zero: a camera at rest cannot see the radius")
        if speed_m_s > self.safety.max_linear_speed_m_s:
            raise ValueError(
                f"motion.velocity_m_s asks for {speed_m_s:.3g} m/s, above "
                f"safety.max_linear_speed_m_s = {self.safety.max_linear_speed_m_s:.3g}"
            )
        if self.arm.hold_s <= 1.0 / self.run.control_rate_hz:
            raise ValueError(
                f"arm.hold_s = {self.arm.hold_s:.3g} is not longer than one tick "
                f"(1 / run.control_rate_hz = {1.0 / self.run.control_rate_hz:.3g} s)"
            )
        simulated = self.camera.driver == "sim"
        if simulated and self.sim.camera.latency_s >= self.run.duration_s:
            raise ValueError(
                f"sim.camera.latency_s = {self.sim.camera.latency_s:.3g} is not shorter than "
                f"run.duration_s = {self.run.duration_s:.3g}: no image would arrive in time"
            )
        return self
