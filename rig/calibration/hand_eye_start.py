"""Hand-eye start values in closed form, from the board's pose in every image."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from rig.calibration import se3
from rig.calibration.board_pose import board_poses
from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye_model import State, linearise
from rig.calibration.projection import to_vector
from rig.calibration.views import BoardView, stack

FloatArray = NDArray[np.float64]

# By keyword always: given by position, calibrateHandEye takes it for an output and stays Tsai.
_METHODS = {
    "Tsai": cv2.CALIB_HAND_EYE_TSAI,
    "Park": cv2.CALIB_HAND_EYE_PARK,
    "Horaud": cv2.CALIB_HAND_EYE_HORAUD,
    "Andreff": cv2.CALIB_HAND_EYE_ANDREFF,
    "Daniilidis": cv2.CALIB_HAND_EYE_DANIILIDIS,
}


def closed_forms(T_base_tool: FloatArray, T_camera_board: FloatArray) -> dict[str, FloatArray]:
    """T_tool_camera (4, 4) by each closed form that gave a rigid motion, by name.

    ``T_base_tool`` and ``T_camera_board`` are (m, 4, 4). Raises CalibrationError when none did.
    """
    arm = [np.ascontiguousarray(T) for T in T_base_tool]
    board = [np.ascontiguousarray(T) for T in T_camera_board]
    out = {}
    for name, method in _METHODS.items():
        try:
            R, t = cv2.calibrateHandEye(
                [T[:3, :3] for T in arm],
                [T[:3, 3] for T in arm],
                [T[:3, :3] for T in board],
                [T[:3, 3] for T in board],
                method=method,
            )
        except cv2.error:
            continue  # one method's degenerate case; the others are tried
        if np.all(np.isfinite(R)) and np.all(np.isfinite(t)) and np.linalg.det(R) > 0.5:
            out[name] = se3.pose(np.asarray(R, dtype=float), np.asarray(t, dtype=float).ravel())
    if not out:
        raise CalibrationError(
            "no closed form finds a hand-eye transform: turn the tool about two different axes"
        )
    return out


def board_in_base(
    T_tool_camera: FloatArray, T_base_tool: FloatArray, T_camera_board: FloatArray
) -> FloatArray:
    """T_base_board (4, 4) in the middle of what the views say, each by itself."""
    each = T_base_tool @ T_tool_camera @ T_camera_board
    return se3.pose(se3.mean_rotation(each[:, :3, :3]), np.median(each[:, :3, 3], axis=0))


def translation_and_scale(
    R_tool_camera: FloatArray, T_base_tool: FloatArray, T_camera_board: FloatArray
) -> tuple[FloatArray, float]:
    """Translation (3,) of T_tool_camera and the ratio of the board's true size to the claimed.

    With the rotation known, (R_A − 1) t = s R t_B − t_A is linear in both, for the relative
    motions A of the tool and B of the camera between any two views. A wrong square size turns
    every t_B into a multiple of the truth and leaves the rotations alone.
    """
    i, j = np.triu_indices(len(T_base_tool), k=1)
    A = se3.inverse(T_base_tool)[j] @ T_base_tool[i]
    B = T_camera_board[j] @ se3.inverse(T_camera_board)[i]
    rows = np.empty((len(i), 3, 4))
    rows[..., :3] = A[:, :3, :3] - np.eye(3)
    rows[..., 3] = -B[:, :3, 3] @ R_tool_camera.T
    right = -A[:, :3, 3]
    found = np.linalg.lstsq(rows.reshape(-1, 4), right.ravel(), rcond=None)[0]
    return np.asarray(found[:3], dtype=float), float(found[3])


def start_state(
    T_base_tool: FloatArray, boards: Sequence[BoardView], intrinsics: Intrinsics
) -> tuple[str, State]:
    """The closed form, by name, that predicts the corners best, and its whole state.

    Raises CalibrationError when none is usable.
    """
    T_camera_board = board_poses(boards, intrinsics)
    corners, values = stack(boards), to_vector(intrinsics)
    best: tuple[float, str, State] | None = None
    for name, X in closed_forms(T_base_tool, T_camera_board).items():
        t, scale = translation_and_scale(X[:3, :3], T_base_tool, T_camera_board)
        if not 0.2 < scale < 5.0:
            scale = 1.0
        for label, shift, size in ((name, X[:3, 3], 1.0), (f"{name}, scaled", t, scale)):
            T_tool_camera = se3.pose(X[:3, :3], shift)
            scaled = se3.pose(T_camera_board[:, :3, :3], size * T_camera_board[:, :3, 3])
            T_base_board = board_in_base(T_tool_camera, T_base_tool, scaled)
            state = State(T_tool_camera, T_base_board, values, size)
            linear = linearise(state, T_base_tool, corners)
            off = np.abs(linear.residuals[linear.residuals != 0.0])
            error = float(np.median(off)) if linear.in_front else np.inf
            if best is None or error < best[0]:
                best = error, label, state
    if best is None or not np.isfinite(best[0]):
        raise CalibrationError(
            "no closed form puts the board in front of the camera: are images and arm poses "
            "paired rightly, and is each pose the tool's in the base, not its inverse?"
        )
    return best[1], best[2]
