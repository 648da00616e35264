"""What a calibration leaves for its report."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration.board_pose import board_pose
from rig.calibration.hand_eye_model import board_seen
from rig.calibration.latency import LatencyFit
from rig.calibration.projection import from_vector
from rig.calibration.result import CalibrationFile
from rig.calibration_run.fits import Geometry, Verification
from rig.calibration_run.recording import Recording
from rig.calibration_run.stills import Still

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Material:
    """A calibration's result with what it was made from; None for steps not done this time."""

    file: CalibrationFile
    stills: Sequence[Still]
    geometry: Geometry | None
    recording: Recording | None
    latency: LatencyFit | None
    verification: Verification | None


@dataclass(frozen=True, slots=True)
class PoseErrors:
    """How far each still is from what arm and calibration predict for it."""

    px: FloatArray  # (m,) rms distance of the corners
    mm: FloatArray  # (m,) of the board's middle
    deg: FloatArray  # (m,) of the board's orientation
    at_px: tuple[FloatArray, ...]  # (n, 2) the corners of each still
    off_px: tuple[FloatArray, ...]  # (n, 2) seen minus predicted


def pose_errors(stills: Sequence[Still], geometry: Geometry) -> PoseErrors:
    """Predict every still, fitted or held out, and compare."""
    state = geometry.state
    lens = from_vector(state.intrinsics)
    px, mm, deg, at, off = [], [], [], [], []
    for still in stills:
        board = still.view.board
        predicted = board_seen(state, still.view.T_base_tool[None])[0]
        measured = board_pose(board, lens)
        middle = np.append(board.points_m.mean(axis=0), 1.0)
        away = board.pixels - lens.project(board.points_m @ predicted[:3, :3].T + predicted[:3, 3])
        px.append(np.sqrt(np.mean(np.sum(away**2, axis=1))))
        mm.append(1e3 * np.linalg.norm(((measured - predicted) @ middle)[:3]))
        turned = se3.log(se3.inverse(predicted) @ measured)[3:]
        deg.append(np.degrees(np.linalg.norm(turned)))
        at.append(board.pixels)
        off.append(away)
    return PoseErrors(np.array(px), np.array(mm), np.array(deg), tuple(at), tuple(off))
