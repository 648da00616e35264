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
from drivers.interfaces import Arm, Camera
from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig, TargetKind

FloatArray = NDArray[np.float64]

# Lazy, so that a vendor's package costs nothing, and need not exist, until it is chosen.
_BUILDERS = {"sim": "rig.build_sim:build_simulated"}


class Truth(Protocol):
    """What a simulated rig knows and a real one does not; for error figures only."""

    radius_m: float


@dataclass(frozen=True, slots=True)
class Devices:
    """What a builder returns: devices, and the geometry they were delivered with."""

    camera: Camera
    arm: Arm
    clock: Clock
    intrinsics: Intrinsics
    T_tool_camera: FloatArray  # (4, 4)
    renderer: str | None  # None on real hardware
    truth: Truth | None  # None on real hardware


class Rig:
    """Open devices with the geometry to use; closing stops the arm, whatever happened."""

    def __init__(self, devices: Devices, config: RigConfig) -> None:
        self.camera = devices.camera
        self.arm = devices.arm
        self.clock = devices.clock
        self.renderer = devices.renderer
        self.truth = devices.truth
        self.intrinsics = _intrinsics(config) or devices.intrinsics
        hand_eye = _hand_eye(config)
        self.T_tool_camera = devices.T_tool_camera if hand_eye is None else hand_eye

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
    """Open the rig's devices; raises ConnectError when one cannot be opened."""
    module, _, name = _BUILDERS[config.arm.driver].partition(":")
    builder = cast(
        Callable[[RigConfig, TargetKind, Clock | None], Devices],
        getattr(import_module(module), name),
    )
    return Rig(builder(config, target, WallClock() if realtime else None), config)


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
