"""The rig's configuration: one validated, frozen tree; every key names its unit."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from rig.config_calibration import CalibrationConfig
from rig.config_devices import ArmConfig, CameraConfig, SimArm, SimCamera
from rig.config_log import LogConfig
from rig.config_motion import MotionConfig
from rig.config_safety import SafetyConfig
from rig.config_section import NotNegative, Positive, Section
from sim_backend.config import SimConfig

TargetKind = Literal["sphere", "cylinder"]

STATING_VARIANCE = ("kalman", "batch", "limb_plane_ekf")
_PAPER_ALPHA: dict[TargetKind, float] = {"sphere": 2000.0, "cylinder": 500.0}


class EstimatorConfig(Section):
    """Which estimator, its first guess, and what it needs to know."""

    # auto: kalman, but the observer where one of its gains is given. The last four are there to
    # compare with.
    kind: Literal[
        "auto", "kalman", "observer", "batch", "triangulation", "limb_plane", "limb_plane_ekf"
    ] = "auto"
    # Of the observer; left out: the paper's for the target, 2000 for a sphere and 500 for a
    # cylinder.
    alpha: Annotated[float, Field(gt=0, le=1e6)] | None = None
    # Of the observer, a multiple of c* = 2 sqrt(alpha) sigma; left out: 1.
    damping: Annotated[float, Field(gt=0, le=20)] | None = None
    radius_guess_m: Annotated[float, Field(gt=0, le=10)] = 0.03
    # The range that the radius is sure to lie in; left out: a third to three times the guess.
    radius_range_m: tuple[Positive, Positive] | None = None
    # Standard deviations of a measured twist, for arms that do not report theirs.
    twist_std_m_s: NotNegative = 2e-4
    twist_std_rad_s: NotNegative = 5e-4
    # Of an image's instant against the arm's stamps, as good as latencies are calibrated.
    time_std_s: NotNegative = 5e-4
    # What else kalman is to find. time_offset: by how much images' stamps are late beyond
    # calibration.latency_s; speed_scale: what the arm's measured speeds are to be multiplied by.
    states: tuple[Literal["time_offset", "speed_scale"], ...] = ()
    time_offset_std_s: Positive = 0.03  # of these beforehand
    speed_scale_std: Positive = 0.05

    @model_validator(mode="after")
    def _guess_in_range(self) -> Self:
        low_m, high_m = self.radius_range
        if not low_m <= self.radius_guess_m <= high_m:
            raise ValueError(
                f"radius_guess_m = {self.radius_guess_m:g} is not in "
                f"radius_range_m = [{low_m:g}, {high_m:g}]"
            )
        return self

    @model_validator(mode="after")
    def _states_of_the_filter(self) -> Self:
        if self.states and self.chosen != "kalman":
            raise ValueError(
                f"states = [{', '.join(self.states)}] are for the Kalman filter: "
                f"set estimator.kind=kalman{self.why_observer}"
            )
        return self

    @property
    def gains_given(self) -> bool:
        """Whether the configuration says how fast the observer is to be."""
        return self.alpha is not None or self.damping is not None

    @property
    def chosen(self) -> str:
        """The kind itself, or what ``auto`` stands for."""
        if self.kind != "auto":
            return self.kind
        return "observer" if self.gains_given else "kalman"

    @property
    def states_variance(self) -> bool:
        """Whether the chosen estimator says how sure it is."""
        return self.chosen in STATING_VARIANCE

    @property
    def why_observer(self) -> str:
        """For messages: what made ``auto`` the observer; "" where nothing did."""
        if self.kind != "auto" or not self.gains_given:
            return ""
        return " (estimator.alpha and estimator.damping are the observer's and chose it)"

    def gains(self, target: TargetKind) -> tuple[float, float]:
        """The observer's alpha and damping for a target."""
        alpha = _PAPER_ALPHA[target] if self.alpha is None else self.alpha
        return alpha, 1.0 if self.damping is None else self.damping

    @property
    def radius_range(self) -> tuple[float, float]:
        """The least and the largest radius to expect, in m."""
        return self.radius_range_m or (self.radius_guess_m / 3.0, self.radius_guess_m * 3.0)


class RunConfig(Section):
    """How long a run lasts and how fast it ticks."""

    duration_s: Annotated[float, Field(gt=0, le=3600)] = 6.0
    control_rate_hz: Annotated[float, Field(ge=10, le=1000)] = 100.0
    until_converged: bool = False
    # End once the stated 95 % interval of R is inside ± this share; not for the observer.
    until_share: Annotated[float, Field(gt=0, lt=1)] | None = None
    # Where images are measured; auto: for a real camera in a process of its own.
    vision: Literal["auto", "thread", "process"] = "auto"
    # Whether the control loop asks the system for real-time priority; auto: where it is allowed.
    scheduling: Literal["auto", "normal", "realtime"] = "auto"
    # Converged: the predicted rest of the observer's transient and the drift of R over the last
    # second, or another estimator's 95 % interval of R, are below this fraction.
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
    log: LogConfig = LogConfig()
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
        if self.run.until_share is not None and not self.estimator.states_variance:
            raise ValueError(
                "run.until_share (--until) needs an estimator that states how sure it is: "
                "set estimator.kind=kalman; the observer has run.until_converged"
                f"{self.estimator.why_observer}"
            )
        if self.motion.policy == "information" and self.estimator.chosen != "kalman":
            raise ValueError(
                "motion.policy = information needs an estimator that states how sure it is: "
                f"set estimator.kind=kalman{self.estimator.why_observer}"
            )
        if self.motion.policy == "servo":
            self._check_servo()
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

    @property
    def ends_when_settled(self) -> bool:
        """Whether a run is over as soon as its estimate is good enough, and a servo arrived."""
        run = self.run
        return run.until_converged or run.until_share is not None or self.motion.policy == "servo"

    @property
    def wanted_share(self) -> float:
        """The half-width of R's 95 % interval, as a share, at which the estimate is good enough."""
        return self.run.converged_fraction if self.run.until_share is None else self.run.until_share

    def _check_servo(self) -> None:
        """Raise ValueError for a distance that the camera may not have."""
        least_m, most_m = self.safety.min_target_distance_m, self.motion.max_target_distance_m
        distance_m = self.motion.servo.distance_m
        if distance_m < least_m:
            raise ValueError(
                f"motion.servo.distance_m = {distance_m:g} is nearer to the target's surface than "
                f"safety.min_target_distance_m = {least_m:g} allows"
            )
        if distance_m > most_m:
            raise ValueError(
                f"motion.servo.distance_m = {distance_m:g} is farther from the target's surface "
                f"than motion.max_target_distance_m = {most_m:g} allows"
            )
