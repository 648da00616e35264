"""The devices of a calibration: a camera that looks at the board, an arm, nominal values."""

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Self, cast

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, WallClock
from drivers.errors import ConfigError
from drivers.interfaces import Arm, Camera
from estimator.image.intrinsics import Intrinsics
from rig.build import Devices, given_geometry, load_entry, open_arm, open_camera
from rig.config import RigConfig

FloatArray = NDArray[np.float64]

_SIMULATED = "rig.build_sim:build_simulated"


@dataclass(frozen=True, slots=True)
class Bench:
    """Open devices and the values a calibration starts from; leaving it stops the arm first."""

    camera: Camera
    arm: Arm
    clock: Clock
    realtime: bool
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
    drivers = (config.camera.driver, config.arm.driver)
    if drivers == ("sim", "sim"):
        build = cast(
            Callable[[RigConfig, str, Clock | None, bool], Devices], load_entry(_SIMULATED)
        )
        devices = build(config, "board", WallClock() if realtime else None, False)
        assert devices.camera is not None  # it was asked for here, not in another process
        intrinsics, T_tool_camera = given_geometry(config, devices)
        return Bench(
            devices.camera, devices.arm, devices.clock, realtime, intrinsics, T_tool_camera
        )
    if "sim" in drivers:
        raise ConfigError(
            f"camera.driver = {drivers[0]} and arm.driver = {drivers[1]} do not go together: "
            "the simulated camera shows what the simulated arm does, so choose both or neither"
        )
    intrinsics, T_tool_camera = given_geometry(config, None)
    clock = WallClock()
    camera = open_camera(config.camera, clock)
    try:
        arm = open_arm(config.arm, clock)
    except BaseException:
        camera.close()
        raise
    return Bench(camera, arm, clock, True, intrinsics, T_tool_camera)
