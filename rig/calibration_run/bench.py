"""The devices of a calibration: a camera that looks at the board, an arm, nominal values."""

from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, WallClock
from drivers.interfaces import Arm, Camera
from estimator.image.intrinsics import Intrinsics
from rig.build import given_geometry, is_simulated, open_arm, open_camera, open_simulated
from rig.config import RigConfig

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Bench:
    """Open devices and the values a calibration starts from; leaving it stops the arm first."""

    camera: Camera
    arm: Arm
    clock: Clock
    intrinsics: Intrinsics
    T_tool_camera: FloatArray  # (4, 4)

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


def open_bench(config: RigConfig, realtime: bool) -> Bench:
    """Open camera and arm in front of the board.

    Raises ConfigError when nominal values are missing or devices do not go together,
    ConnectError when one cannot be opened.
    """
    if is_simulated(config):
        devices = open_simulated(config, "board", realtime, camera_elsewhere=False)
        assert devices.camera is not None  # it was asked for here, not in another process
        intrinsics, T_tool_camera = given_geometry(config, devices)
        devices.everything_ready()
        return Bench(devices.camera, devices.arm, devices.clock, intrinsics, T_tool_camera)
    intrinsics, T_tool_camera = given_geometry(config, None)
    clock = WallClock()
    camera = open_camera(config.camera, clock)
    try:
        arm = open_arm(config.arm, clock)
    except BaseException:
        camera.close()
        raise
    return Bench(camera, arm, clock, intrinsics, T_tool_camera)
