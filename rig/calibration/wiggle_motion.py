"""What a small motion of the tool does to the image, and the reverse."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from rig.calibration import se3

FloatArray = NDArray[np.float64]

_STEPS = 6


@dataclass(frozen=True, slots=True)
class Glimpse:
    """Two images around one small motion, with the calibration they are judged by."""

    points_m: FloatArray  # (n, 3) on the board
    T_camera_board: FloatArray  # (4, 4) before the motion
    T_tool_camera: FloatArray  # (4, 4)
    intrinsics: Intrinsics
    tool_moved: FloatArray  # (6,) twist of the tool in its axes, by the arm
    observed_px: FloatArray  # (n, 2) displacements

    def displacements(self, twist: FloatArray, lever_m: FloatArray | None = None) -> FloatArray:
        """How the corners move (n, 2) when the tool does (6,), the camera ``lever_m`` elsewhere."""
        X = self.T_tool_camera
        if lever_m is not None:
            X = se3.pose(X[:3, :3], X[:3, 3] + lever_m)
        after = se3.inverse(se3.exp(twist) @ X) @ X @ self.T_camera_board
        return self._pixels(after) - self._pixels(self.T_camera_board)

    def seen_linear(self) -> FloatArray:
        """The translation (3,) of the tool that explains the image, given the arm's turn."""
        turn = self.tool_moved[3:]
        return _solved(
            lambda v: self.displacements(np.append(v, turn)) - self.observed_px,
            self.tool_moved[:3],
        )

    def seen_turn(self) -> FloatArray:
        """The turn (3,) of the tool that explains the image, given the arm's translation."""
        shift = self.tool_moved[:3]
        return _solved(
            lambda w: self.displacements(np.append(shift, w)) - self.observed_px,
            self.tool_moved[3:],
        )

    def _pixels(self, T_camera_board: FloatArray) -> FloatArray:
        points = self.points_m @ T_camera_board[:3, :3].T + T_camera_board[:3, 3]
        return np.asarray(self.intrinsics.project(points), dtype=float)


def fitted_lever(glimpses: list[Glimpse]) -> tuple[FloatArray, float]:
    """By which vector (3,) in tool axes the camera seems to sit elsewhere, and what is left.

    What is left is the rms mismatch in px with the camera there.
    """

    def off(d: FloatArray) -> FloatArray:
        parts = [one.displacements(one.tool_moved, d) - one.observed_px for one in glimpses]
        return np.concatenate(parts)

    lever = _solved(off, np.zeros(3))
    return lever, float(np.sqrt(np.mean(np.sum(off(lever) ** 2, axis=1))))


def _solved(off: Callable[[FloatArray], FloatArray], start: FloatArray) -> FloatArray:
    """Gauss–Newton on three unknowns; the motions are small, the problem nearly linear."""
    x, h = start.copy(), 1e-6
    for _ in range(_STEPS):
        J = np.stack([(off(x + h * e) - off(x - h * e)).ravel() / (2 * h) for e in np.eye(3)])
        x = x - np.linalg.lstsq(J.T, off(x).ravel(), rcond=None)[0]
    return x
