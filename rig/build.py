"""From a configuration to devices: the only place that chooses simulated or real."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from importlib import import_module
from types import TracebackType
from typing import Protocol, Self, cast

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, WallClock
from drivers.errors import ConfigError
from drivers.interfaces import Arm, Camera
from estimator.image.intrinsics import Intrinsics
from estimator.image.tracker import TargetTracker, warm_up
from rig.config import RigConfig, TargetKind
from rig.config_devices import ArmConfig, CameraConfig
from rig.given_values import hand_eye_of, intrinsics_of
from rig.image_size import SizedVision
from rig.tcp_offset import check_tcp
from rig.vision import Vision
from rig.vision.inline import InlineVision
from rig.vision.messages import Job
from rig.vision.process import Feed, ProcessVision
from rig.vision.threaded import ThreadedVision

FloatArray = NDArray[np.float64]

# Lazy, so that a vendor's package costs nothing, and need not exist, until it is chosen.
_SIMULATED = "rig.build_sim:build_simulated"
_REMOTE_CAMERA = "rig.build_sim:build_remote_camera"
_CAMERAS = {"opencv": "drivers.camera.open:open_camera"}
_ARMS = {"ur": "drivers.ur.arm:UrArm", "grbl": "drivers.grbl.arm:GrblArm"}

# Arms that have a pendant or can be led by hand: listened to without taking control.
_LISTENERS = {"ur": "drivers.ur.listener:UrListener"}


class Truth(Protocol):
    """What a simulated rig knows and a real one does not; for error figures only."""

    @property
    def radius_m(self) -> float:
        """The target's radius."""
        ...


@dataclass(frozen=True, slots=True)
class Devices:
    """Simulated devices, and the geometry they were delivered with."""

    camera: Camera | None  # None: it is simulated in the vision process
    feed: Feed | None  # what that camera follows
    arm: Arm
    clock: Clock
    intrinsics: Intrinsics | None
    T_tool_camera: FloatArray | None  # (4, 4)
    renderer: str | None  # None on real hardware
    truth: Truth | None  # None on real hardware
    features: Vision | None  # sees without images; where set, the camera is not for use
    everything_ready: Callable[[], None]  # to be called when vision is: time begins to matter


@dataclass(frozen=True, slots=True)
class Rig:
    """An open arm, vision at work, and the geometry to use; leaving it stops the arm first."""

    arm: Arm
    vision: Vision
    clock: Clock
    realtime: bool  # whether the clock runs by itself
    intrinsics: Intrinsics
    T_tool_camera: FloatArray  # (4, 4)
    renderer: str | None = None  # None on real hardware
    truth: Truth | None = None  # None on real hardware

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self.arm.close()
        finally:
            self.vision.close()


def build_rig(config: RigConfig, target: TargetKind, realtime: bool) -> Rig:
    """Open the rig for a run; ``realtime`` puts a simulated rig on the wall clock.

    Raises ConfigError for devices that do not go together or lack a calibration, ConnectError
    when one cannot be opened. What was opened before is closed again.
    """
    if is_simulated(config):
        return _simulated(config, target, realtime)
    return _hardware(config, target)


def is_simulated(config: RigConfig) -> bool:
    """Whether both devices are simulated; raises ConfigError when only one of them is."""
    drivers = (config.camera.driver, config.arm.driver)
    if drivers != ("sim", "sim") and "sim" in drivers:
        raise ConfigError(
            f"camera.driver = {drivers[0]} and arm.driver = {drivers[1]} do not go together: "
            "the simulated camera shows what the simulated arm does, so choose both or neither"
        )
    return "sim" in drivers


def open_simulated(
    config: RigConfig, scene: str, realtime: bool, camera_elsewhere: bool
) -> Devices:
    """The simulated rig in front of a target or the board."""
    build = cast(Callable[[RigConfig, str, Clock | None, bool], Devices], load_entry(_SIMULATED))
    return build(config, scene, WallClock() if realtime else None, camera_elsewhere)


def open_camera(config: CameraConfig, clock: Clock) -> Camera:
    """A real camera; raises ConnectError when it cannot be opened."""
    camera_of = cast(Callable[[object, Clock], Camera], load_entry(_CAMERAS[config.driver]))
    return camera_of(config, clock)


def open_arm(config: ArmConfig, clock: Clock) -> Arm:
    """A real arm; raises ConnectError when it cannot be opened."""
    arm_of = cast(Callable[[object, Clock], Arm], load_entry(_ARMS[config.driver]))
    return arm_of(config, clock)


def open_listener(config: ArmConfig, clock: Clock) -> Arm | None:
    """A real arm that is only listened to; None for one that cannot be moved otherwise.

    Raises ConnectError when it cannot be opened.
    """
    if config.driver not in _LISTENERS:
        return None
    arm_of = cast(Callable[[object, Clock], Arm], load_entry(_LISTENERS[config.driver]))
    return arm_of(config, clock)


def open_remote_camera(
    config: RigConfig, target: TargetKind, feed: int | None, clock: Clock
) -> Camera:
    """The camera as the vision process opens it: a real one, or one that follows a ``feed``."""
    if feed is None:
        return open_camera(config.camera, clock)
    build = cast(Callable[[RigConfig, TargetKind, int, Clock], Camera], load_entry(_REMOTE_CAMERA))
    return build(config, target, feed, clock)


def _simulated(config: RigConfig, target: TargetKind, realtime: bool) -> Rig:
    apart = realtime and config.run.vision != "thread" and config.sim.level == "pixels"
    devices = open_simulated(config, target, realtime, apart)
    intrinsics, T_tool_camera = given_geometry(config, devices)
    vision: Vision
    if devices.features is not None:
        vision = devices.features
    elif devices.camera is None:
        vision = ProcessVision(Job(config, target, intrinsics), devices.clock, devices.feed)
    else:
        here = ThreadedVision if realtime else InlineVision
        vision = here(devices.camera, _tracker(config, target, intrinsics))
    vision = _sized(vision, config) if devices.features is None else vision
    check_tcp(devices.arm, config.calibration.tcp_offset)
    devices.everything_ready()
    return Rig(
        arm=devices.arm,
        vision=vision,
        clock=devices.clock,
        realtime=realtime,
        intrinsics=intrinsics,
        T_tool_camera=T_tool_camera,
        renderer=devices.renderer,
        truth=devices.truth,
    )


def _hardware(config: RigConfig, target: TargetKind) -> Rig:
    # First of all: nothing is opened for a rig that cannot be used.
    intrinsics, T_tool_camera = given_geometry(config, None)
    clock = WallClock()
    vision = _real_vision(config, target, intrinsics, clock)
    with ExitStack() as opened:
        opened.callback(vision.close)
        arm = open_arm(config.arm, clock)
        opened.callback(arm.close)
        check_tcp(arm, config.calibration.tcp_offset)
        opened.pop_all()
    return Rig(arm, vision, clock, True, intrinsics, T_tool_camera)


def _real_vision(
    config: RigConfig, target: TargetKind, intrinsics: Intrinsics, clock: Clock
) -> Vision:
    if config.run.vision == "thread":
        tracker = _tracker(config, target, intrinsics)
        return _sized(ThreadedVision(open_camera(config.camera, clock), tracker), config)
    return _sized(ProcessVision(Job(config, target, intrinsics), clock), config)


def _sized(vision: Vision, config: RigConfig) -> Vision:
    """Vision that accepts only images that the intrinsics hold for, where that is known."""
    given = config.calibration.intrinsics
    size_px = None if given is None else given.image_size_px
    return vision if size_px is None else SizedVision(vision, size_px)


def _tracker(config: RigConfig, target: TargetKind, intrinsics: Intrinsics) -> TargetTracker:
    """A tracker whose kernels are compiled."""
    warm_up(target, intrinsics, config.camera.method)
    return TargetTracker(target, intrinsics, config.camera.method)


def load_entry(entry: str) -> object:
    """What ``module:name`` names, imported only now."""
    module, _, name = entry.partition(":")
    return getattr(import_module(module), name)


def given_geometry(config: RigConfig, devices: Devices | None) -> tuple[Intrinsics, FloatArray]:
    """The calibration of the configuration, or else what the devices were delivered with."""
    intrinsics, T_tool_camera = intrinsics_of(config), hand_eye_of(config)
    if devices is not None:
        intrinsics = intrinsics or devices.intrinsics
        T_tool_camera = devices.T_tool_camera if T_tool_camera is None else T_tool_camera
    if intrinsics is None or T_tool_camera is None:
        missing = "intrinsics" if intrinsics is None else "tool_camera_xyz_m and _rotvec_rad"
        raise ConfigError(
            f"calibration.{missing} must be known, and these devices do not know it themselves: "
            "run `rig calibrate` with the rig file"
        )
    return intrinsics, T_tool_camera
