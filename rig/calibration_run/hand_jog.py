"""Small steps of the camera by keys, for an arm that has no pendant."""

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration_run.mover import Mover

FloatArray = NDArray[np.float64]

_STEP_M, _STEP_RAD = 0.02, np.radians(5.0)
_FACTORS = (0.2, 1.0, 3.0)
# Key → motion in camera axes: x right, y down, z forward; turns go about the board's middle.
_MOTIONS: dict[str, tuple[float, ...]] = {
    "a": (-1, 0, 0, 0, 0, 0),
    "d": (1, 0, 0, 0, 0, 0),
    "w": (0, -1, 0, 0, 0, 0),
    "s": (0, 1, 0, 0, 0, 0),
    "f": (0, 0, 1, 0, 0, 0),
    "b": (0, 0, -1, 0, 0, 0),
    "i": (0, 0, 0, 1, 0, 0),
    "k": (0, 0, 0, -1, 0, 0),
    "j": (0, 0, 0, 0, 1, 0),
    "l": (0, 0, 0, 0, -1, 0),
    "o": (0, 0, 0, 0, 0, 1),
    "p": (0, 0, 0, 0, 0, -1),
}
HELP = (
    "a d w s: left right up down; f b: forward back; i k j l: round the board; o p: roll; "
    "1 2 3: small, middle, large steps"
)


class HandJog:
    """Moves the camera by one step a key; turns keep the board in view."""

    def __init__(self, mover: Mover, T_tool_camera: FloatArray) -> None:
        self._mover = mover
        self._T_tool_camera = T_tool_camera
        self._factor = 1.0

    def press(self, key: str, board_m: FloatArray | None) -> bool:
        """Carry out a key, if it is one; ``board_m`` (3,) is the board's middle, in the camera.

        Raises PoseRefusedError when the arm does not get there.
        """
        if key in "123" and key:
            self._factor = _FACTORS[int(key) - 1]
            return True
        if key not in _MOTIONS:
            return False
        motion = np.array(_MOTIONS[key]) * self._factor
        shift, turn = _STEP_M * motion[:3], _STEP_RAD * motion[3:]
        pivot = np.zeros(3) if board_m is None else board_m
        R = se3.exp(np.concatenate([np.zeros(3), turn]))[:3, :3]
        step = se3.pose(R, shift + pivot - R @ pivot)
        X = self._T_tool_camera
        self._mover.go_to(self._mover.T_base_tool @ X @ step @ se3.inverse(X))
        return True
