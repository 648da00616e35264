"""Where the board stands in front of the camera, from the corners of one image."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from rig.calibration import se3
from rig.calibration.errors import CalibrationError
from rig.calibration.projection import camera_matrix
from rig.calibration.views import BoardView

FloatArray = NDArray[np.float64]

MIN_CORNERS = 6  # four determine a pose; two more leave something to judge it by


def board_pose(view: BoardView, intrinsics: Intrinsics) -> FloatArray:
    """T_camera_board (4, 4) with the least reprojection error, of the two a plane can have.

    Raises CalibrationError with fewer than six corners or when they lie on a line.
    """
    if len(view) < MIN_CORNERS:
        raise CalibrationError(f"{len(view)} corners of the board in view, {MIN_CORNERS} needed")
    spread = np.linalg.svd(view.points_m - view.points_m.mean(axis=0), compute_uv=False)
    if spread[1] < 0.05 * spread[0]:
        raise CalibrationError("the corners in view lie on one line: show more of the board")
    points, K = view.points_m, camera_matrix(intrinsics)
    try:
        count, turns, shifts, _ = cv2.solvePnPGeneric(
            points, view.pixels, K, intrinsics.distortion, flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error as error:
        raise CalibrationError(f"no pose of the board fits the corners: {error.err}") from error
    if not count:
        raise CalibrationError("no pose of the board fits the corners")
    best: tuple[float, FloatArray] | None = None
    for turn, shift in zip(turns, shifts, strict=True):
        # IPPE is algebraic: only after this do the two errors compare.
        turn, shift = cv2.solvePnPRefineLM(
            points, view.pixels, K, intrinsics.distortion, turn, shift
        )
        seen = cv2.projectPoints(points, turn, shift, K, intrinsics.distortion)[0][:, 0]
        off = float(np.sum((seen - view.pixels) ** 2))
        if best is None or off < best[0]:
            xyz, rotvec = np.asarray(shift, float).ravel(), np.asarray(turn, float).ravel()
            best = off, se3.from_xyz_rotvec(xyz, rotvec)
    if best is None or not np.all(np.isfinite(best[1])):
        raise CalibrationError("no pose of the board fits the corners")
    return best[1]


def board_poses(views: Sequence[BoardView], intrinsics: Intrinsics) -> FloatArray:
    """T_camera_board (m, 4, 4) of every view; raises like ``board_pose``."""
    return np.array([board_pose(view, intrinsics) for view in views]).reshape(-1, 4, 4)
