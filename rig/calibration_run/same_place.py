"""Whether board and camera still are where they were when the first still was taken."""

import numpy as np

from rig.calibration.board_pose import board_pose
from rig.calibration.hand_eye_model import State, board_seen
from rig.calibration.projection import from_vector, project
from rig.calibration.views import PosedView

_MOVED_PX = 3.0


def moved_px(first: PosedView, now: PosedView, state: State) -> float:
    """How far (rms, px) the corners are from where the arm's own motion takes them.

    ``state`` holds camera and hand-eye, roughly: the motion between the two views is small.
    Infinite when they have no corner in common.
    """
    common, i, k = np.intersect1d(first.board.ids, now.board.ids, return_indices=True)
    if not len(common):
        return float("inf")
    T_camera_board = board_pose(first.board, from_vector(state.intrinsics))
    T_base_board = first.T_base_tool @ state.T_tool_camera @ T_camera_board
    there = State(state.T_tool_camera, T_base_board, state.intrinsics)
    T = board_seen(there, np.array([first.T_base_tool, now.T_base_tool]))
    points = np.broadcast_to(first.board.points_m[i], (2, len(common), 3))
    before, after = project(state.intrinsics, T, points).pixels
    seen = now.board.pixels[k] - first.board.pixels[i]
    return float(np.sqrt(np.mean(np.sum((seen - (after - before)) ** 2, axis=1))))


def why_moved(first: PosedView, now: PosedView, state: State) -> str:
    """That something was moved, in words, or ""."""
    off_px = moved_px(first, now, state)
    if off_px <= _MOVED_PX:
        return ""
    return (
        f"the board is seen {off_px:.0f} px from where it was when the first still was taken: "
        "board, camera or arm base was moved since; put it back, or leave --resume out to start "
        "anew"
    )
