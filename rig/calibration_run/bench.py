"""The devices of a calibration: a camera that looks at the board, an arm, nominal values."""

from contextlib import ExitStack, closing
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, WallClock
from drivers.errors import DeviceTimeoutError
from drivers.interfaces import Arm, Camera
from estimator.image.intrinsics import Intrinsics
from rig.build import (
    given_geometry,
    is_simulated,
    open_arm,
    open_camera,
    open_listener,
    open_simulated,
)
from rig.calibration.result import Fingerprints
from rig.config import RigConfig
from rig.deadman import Deadman
from rig.given_values import hand_eye_of, intrinsics_of
from rig.image_size import SizedCamera
from rig.remarks import tell_remarks
from rig.start_values import ASSUMED, start_intrinsics, start_place
from rig.tcp_offset import tcp_fingerprint

FloatArray = NDArray[np.float64]

_FIRST_FRAME_S = 5.0


@dataclass(frozen=True, slots=True)
class Bench:
    """Open devices and the values a calibration starts from; leaving it stops the arm first."""

    camera: Camera
    arm: Arm
    clock: Clock
    intrinsics: Intrinsics
    T_tool_camera: FloatArray  # (4, 4)
    deadman: Deadman | None  # on the wall clock
    moves: bool = True  # whether the arm takes commands; else somebody moves it by hand
    size_px: tuple[int, int] | None = None  # of the images, where the configuration leaves it open
    assumed: str = ""  # in words, what of the values to start from is a guess

    def conditions(self) -> Fingerprints:
        """What the open devices tell of the conditions that pictures are taken under."""
        size = {} if self.size_px is None else {"image size": "x".join(map(str, self.size_px))}
        return tcp_fingerprint(self.arm) | size

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        with closing(self.camera), ExitStack() as last:
            if self.deadman is not None:
                last.callback(self.deadman.close)
            self.arm.close()


def open_bench(config: RigConfig, realtime: bool, by_hand: bool = False) -> Bench:
    """Open camera and arm in front of the board; ``by_hand``: an arm that can be led is not moved.

    Raises ConfigError when nominal values are missing or devices do not go together,
    ConnectError when one cannot be opened.
    """
    if is_simulated(config):
        devices = open_simulated(config, "board", realtime, camera_elsewhere=False)
        assert devices.camera is not None  # it was asked for here, not in another process
        intrinsics, T_tool_camera = given_geometry(config, devices)
        devices.everything_ready()
        deadman = _deadman(config, devices.clock, devices.arm) if realtime else None
        camera = _sized(devices.camera, config)
        return Bench(camera, devices.arm, devices.clock, intrinsics, T_tool_camera, deadman)
    # Before anything is opened; by hand, no motion is planned with it.
    unknown = by_hand and hand_eye_of(config) is None
    T_tool_camera = np.eye(4) if unknown else start_place(config)
    clock = WallClock()
    with ExitStack() as opened:
        camera = _sized(open_camera(config.camera, clock), config)
        opened.callback(camera.close)
        size_px = _image_size(camera)
        intrinsics = start_intrinsics(config, *size_px)
        listener = open_listener(config.arm, clock) if by_hand else None
        arm = open_arm(config.arm, clock) if listener is None else listener
        opened.pop_all()
    deadman = _deadman(config, clock, arm) if listener is None else None
    tell_remarks(arm)
    assumed = ASSUMED if intrinsics_of(config) is None else ""
    return Bench(
        *(camera, arm, clock, intrinsics, T_tool_camera, deadman),
        moves=listener is None,
        size_px=size_px,
        assumed=assumed,
    )


def _image_size(camera: Camera) -> tuple[int, int]:
    """Width and height as a first look shows them; raises DeviceTimeoutError without one."""
    frame = camera.read(_FIRST_FRAME_S)
    if frame is None:
        raise DeviceTimeoutError(
            f"no picture within {_FIRST_FRAME_S:g} s: check the camera and its connection"
        )
    return frame.image.shape[1], frame.image.shape[0]


def _sized(camera: Camera, config: RigConfig) -> Camera:
    """A camera that delivers only what the intrinsics to start from hold for, where known."""
    given = config.calibration.intrinsics
    size_px = None if given is None else given.image_size_px
    return camera if size_px is None else SizedCamera(camera, size_px)


def _deadman(config: RigConfig, clock: Clock, arm: Arm) -> Deadman:
    """Guards the arm's motions, behind which driver and controller have limits of their own."""
    return Deadman(clock, config.arm.hold_s, arm.stop)
