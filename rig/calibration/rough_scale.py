"""The board's size by a few moves of the arm, when there are too few poses for a fit."""

from collections.abc import Sequence

import numpy as np

from rig.calibration.board_pose import board_poses
from rig.calibration.errors import ScaleError
from rig.calibration.hand_eye_model import State
from rig.calibration.projection import from_vector
from rig.calibration.views import PosedView

_CLEARLY_WRONG = 0.25
_LEAST_MOVE_M = 0.02


def rough_scale(views: Sequence[PosedView], state: State) -> float | None:
    """The board's true size over the claimed one; None when the camera hardly moved.

    ``state`` holds the hand-eye transform and intrinsics, which may be wrong by some degrees
    and per cent. The board stands still: where each view has it, s times as far, must agree.
    """
    boards = board_poses([view.board for view in views], from_vector(state.intrinsics))
    cameras = np.array([view.T_base_tool for view in views]) @ state.T_tool_camera
    ways = (cameras[:, :3, :3] @ boards[:, :3, 3:])[..., 0]
    ways -= ways.mean(axis=0)
    centres = cameras[:, :3, 3] - cameras[:, :3, 3].mean(axis=0)
    if len(views) < 2 or float(np.abs(centres).max()) < _LEAST_MOVE_M:
        return None
    return float(-np.sum(ways * centres) / np.sum(ways**2))


def check_rough_scale(views: Sequence[PosedView], state: State, square_m: float) -> None:
    """Raise ScaleError when the board is far from as large as it is claimed to be."""
    scale = rough_scale(views, state)
    if scale is not None and abs(scale - 1.0) > _CLEARLY_WRONG:
        raise ScaleError(
            f"the arm's motion contradicts the board's size by the ratio {scale:.2f}, roughly, as "
            f"{len(views)} poses show: a square would measure about {1e3 * scale * square_m:.0f} "
            f"mm, the board's definition says {1e3 * square_m:.2f} mm. Measure the print and "
            "correct the definition"
        )
