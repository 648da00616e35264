"""Rendered pictures of a ball, as files that the camera driver plays: a load like a real one."""

from pathlib import Path

import numpy as np

from drivers.clock import Clock
from drivers.errors import OperateError
from drivers.interfaces import GreyImage
from estimator.image.intrinsics import Intrinsics
from sim_backend.clock import SimulatedClock
from sim_backend.config import SimConfig
from sim_backend.rig import SimulatedRig

RATE_HZ = 30.0
_COUNT = 30
_SPEED_M_S = 0.03
_HOLD_S = 0.1


def render_pictures(folder: Path) -> Intrinsics:
    """Write a second of a camera passing a ball, there and back, so that it can be repeated.

    Returns the camera's intrinsics; raises RigError.
    """
    import cv2

    clock: Clock = SimulatedClock()
    # The renderer that every machine has: this is about measuring, not about drawing.
    rig = SimulatedRig(SimConfig(renderer="raster"), "sphere", clock)
    intrinsics = Intrinsics(*rig.intrinsics)
    images: list[GreyImage] = []
    try:
        while len(images) < _COUNT:
            rig.arm.command_twist(np.array([_SPEED_M_S, 0.0, 0.0, 0.0, 0.0, 0.0]), _HOLD_S)
            frame = rig.camera.read(timeout_s=0.05)
            if frame is not None:
                images.append(frame.image)
    finally:
        rig.close()
    for number, image in enumerate([*images, *images[-2:0:-1]]):
        if not cv2.imwrite(str(folder / f"{number:03d}.png"), image):
            raise OperateError(f"cannot write pictures below {folder}: make room there")
    return intrinsics
