"""From a configuration to devices: the only place that chooses simulated or real."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from types import TracebackType
from typing import Protocol, Self, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drivers.clock import Clock, WallClock
from drivers.errors import ConfigError
from drivers.interfaces import Arm, Camera
from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig, TargetKind

FloatArray = NDArray[np.float64]

# Lazy, so that a vendor's package costs nothing, and need not exist, until it is chosen.
_SIMULATED = "rig.build_sim:build_simulated"
_CAMERAS = {"opencv": "drivers.camera.open:open_camera"}
_ARMS = {"ur": "drivers.ur.arm:UrArm", "grbl": "drivers.grbl.arm:GrblArm"}


class Truth(Protocol):
    """What a simulated rig knows and a real one does not; for error figures only."""

    radius_m: float


@dataclass(frozen=True, slots=True)
class Devices:
    """Open devices, and the geometry they were delivered with (None: it has to be calibrated)."""

    camera: Camera
    arm: Arm
    clock: Clock
    realtime: bool  # whether the clock runs by itself
    intrinsics: Intrinsics | None
    T_tool_camera: FloatArray | None  # (4, 4)
    renderer: str | None  # None on real hardware
    truth: Truth | None  # None on real hardware


class Rig:
    """Open devices with the geometry to use; closing stops the arm, whatever happened."""

    def __init__(self, devices: Devices, config: RigConfig) -> None:
        self.camera = devices.camera
        self.arm = devices.arm
        self.clock = devices.clock
        self.realtime = devices.realtime
        self.renderer = devices.renderer
        self.truth = devices.truth
        self.intrinsics, self.T_tool_camera = _geometry(config, devices)

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
            self.camera.close()


def build_rig(config: RigConfig, target: TargetKind, realtime: bool) -> Rig:
    """Open the rig's devices; ``realtime`` puts a simulated rig on the wall clock.

    Raises ConfigError for devices that do not go together or lack a calibration, ConnectError
    when one cannot be opened. What was opened before is closed again.
    """
    drivers = (config.camera.driver, config.arm.driver)
    if drivers == ("sim", "sim"):
        simulated = cast(
            Callable[[RigConfig, TargetKind, Clock | None], Devices], _load(_SIMULATED)
        )
        return Rig(simulated(config, target, WallClock() if realtime else None), config)
    if "sim" in drivers:
        raise ConfigError(
            f"camera.driver = {drivers[0]} and arm.driver = {drivers[1]} do not go together: "
            "the simulated camera shows what the simulated arm does, so choose both or neither"
        )
    return _open_hardware(config)


def _open_hardware(config: RigConfig) -> Rig:
    _geometry(config, None)  # nothing is opened for a rig that cannot be used
    clock = WallClock()
    camera_of = cast(Callable[[object, Clock], Camera], _load(_CAMERAS[config.camera.driver]))
    arm_of = cast(Callable[[object, Clock], Arm], _load(_ARMS[config.arm.driver]))
    camera = camera_of(config.camera, clock)
    try:
        arm = arm_of(config.arm, clock)
    except BaseException:
        camera.close()
        raise
    return Rig(Devices(camera, arm, clock, True, None, None, None, None), config)


def _load(entry: str) -> object:
    module, _, name = entry.partition(":")
    return getattr(import_module(module), name)


def _geometry(config: RigConfig, devices: Devices | None) -> tuple[Intrinsics, FloatArray]:
    """The calibration of the configuration, or else what the devices were delivered with."""
    intrinsics, T_tool_camera = _intrinsics(config), _hand_eye(config)
    if devices is not None:
        intrinsics = intrinsics or devices.intrinsics
        T_tool_camera = devices.T_tool_camera if T_tool_camera is None else T_tool_camera
    if intrinsics is None or T_tool_camera is None:
        missing = "intrinsics" if intrinsics is None else "tool_camera_xyz_m and _rotvec_rad"
        raise ConfigError(
            f"calibration.{missing} must be given: these devices do not know it themselves"
        )
    return intrinsics, T_tool_camera


def _intrinsics(config: RigConfig) -> Intrinsics | None:
    given = config.calibration.intrinsics
    if given is None:
        return None
    return Intrinsics(
        given.fx_px, given.fy_px, given.cx_px, given.cy_px, np.array(given.distortion)
    )


def _hand_eye(config: RigConfig) -> FloatArray | None:
    given = config.calibration
    if given.tool_camera_xyz_m is None or given.tool_camera_rotvec_rad is None:
        return None
    T_tool_camera = np.eye(4)
    T_tool_camera[:3, :3] = Rotation.from_rotvec(given.tool_camera_rotvec_rad).as_matrix()
    T_tool_camera[:3, 3] = given.tool_camera_xyz_m
    return T_tool_camera
