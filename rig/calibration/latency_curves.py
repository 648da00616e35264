"""How well images and arm agree as a function of the time between them, for the eye."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.calibration.hand_eye_model import State, board_seen
from rig.calibration.projection import from_vector
from rig.calibration.trajectory import Trajectory
from rig.calibration.views import StampedView, stack

FloatArray = NDArray[np.float64]


def residual_over_offset(
    views: Sequence[StampedView], arm: Trajectory, state: State, offsets_s: FloatArray
) -> FloatArray:
    """Rms distance (k,) of the corners, px, if the images' stamps were ``offsets_s`` (k,) late.

    Nothing is fitted: board and camera stay where ``state`` has them. nan where the arm's record
    does not reach.
    """
    stamps = np.array([view.t_s for view in views])
    corners = stack([view.board for view in views])
    lens = from_vector(state.intrinsics)
    out = np.full(len(offsets_s), np.nan)
    for k, offset_s in enumerate(offsets_s):
        inside = arm.holds(stamps - offset_s)
        if not inside.any():
            continue
        T = board_seen(state, arm.poses(stamps[inside] - offset_s))
        seen = corners.only(inside)
        p = seen.points_m @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]
        away = np.sum((seen.pixels - lens.project(p)) ** 2, axis=2) * seen.seen
        out[k] = np.sqrt(away.sum() / seen.seen.sum())
    return out
