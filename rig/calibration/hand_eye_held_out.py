"""The error on poses that the fit has never seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration.board_pose import board_pose
from rig.calibration.hand_eye_model import State, board_seen
from rig.calibration.projection import from_vector
from rig.calibration.views import PosedView

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class HeldOutError:
    """How far predictions from the arm's pose are off what the image shows; rms over views."""

    px: float  # distance of the corners
    mm: float  # of the board's middle
    deg: float  # of the board's orientation


def held_out_error(views: Sequence[PosedView], state: State) -> HeldOutError:
    """Predict each view from the arm's pose and the calibration, and compare."""
    intrinsics = from_vector(state.intrinsics)
    squares, corners, shifts, turns = 0.0, 0, [], []
    for view in views:
        board = view.board
        predicted = board_seen(state, view.T_base_tool[None])[0]
        measured = board_pose(board, intrinsics)
        at = intrinsics.project(board.points_m @ predicted[:3, :3].T + predicted[:3, 3])
        squares += float(np.sum((board.pixels - at) ** 2))
        corners += len(board)
        middle = np.append(board.points_m.mean(axis=0), 1.0)
        shifts.append(np.linalg.norm(((measured - predicted) @ middle)[:3]))
        turns.append(np.linalg.norm(se3.log(se3.inverse(predicted) @ measured)[3:]))
    return HeldOutError(
        px=float(np.sqrt(squares / corners)),
        mm=1e3 * float(np.sqrt(np.mean(np.square(shifts)))),
        deg=float(np.degrees(np.sqrt(np.mean(np.square(turns))))),
    )
