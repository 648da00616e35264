"""The time offset between images and arm within some ten milliseconds, over a wide range."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from rig.calibration.board_pose import board_poses
from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye_model import State, board_seen
from rig.calibration.projection import from_vector
from rig.calibration.trajectory import Trajectory
from rig.calibration.views import StampedView

FloatArray = NDArray[np.float64]

_STEP_S = 0.004
_MIN_SHARE = 0.7  # of the frames must lie within the arm's record at a lag
_MIN_CORRELATION = 0.8
_SAME_PEAK_S = 0.06
_AMBIGUOUS = 0.95  # of the highest peak
_MIN_SPEED_PX_S = 12.0


@dataclass(frozen=True, slots=True)
class Coarse:
    """The lag at which predicted and measured image motion agree best."""

    latency_s: float
    correlation: float
    speed_px_s: float  # rms of the image motion


def coarse_latency(
    views: Sequence[StampedView], arm: Trajectory, state: State, range_s: float
) -> Coarse:
    """By how much the images' stamps are late against the arm's, within ± ``range_s``.

    Correlates the displacement of the board's outline from frame to frame with the one that
    the arm's motion predicts. Raises CalibrationError when there is hardly any motion, no
    agreement, or more than one lag that fits.
    """
    times = np.array([view.t_s for view in views])
    moved = np.diff(_seen(views, state), axis=0)
    speed = float(np.sqrt(np.mean((moved / np.diff(times)[:, None]) ** 2) * 2.0))
    if speed < _MIN_SPEED_PX_S:
        raise CalibrationError(
            f"the image moves at only {speed:.1f} px/s rms, too slowly to time it: wiggle the "
            "camera across the board at 0.5 Hz and more, by a centimetre or two"
        )
    lags, correlations = correlation_over_lag(views, arm, state, range_s)
    if len(lags) == 0:
        raise CalibrationError(
            "the arm's record hardly overlaps the images: record both over the same time, the "
            f"arm {range_s:.1f} s longer on both sides"
        )
    return _peak(lags, correlations, speed, range_s)


def correlation_over_lag(
    views: Sequence[StampedView], arm: Trajectory, state: State, range_s: float
) -> tuple[FloatArray, FloatArray]:
    """Lags (k,), s, that can be judged, and how predicted and seen motion correlate at each."""
    times = np.array([view.t_s for view in views])
    steps = int((arm.end_s - arm.start_s) / _STEP_S)
    # Not np.arange with an end: rounding can put its last value behind that.
    grid = np.minimum(arm.start_s + _STEP_S * np.arange(steps + 1), arm.end_s)
    intrinsics = from_vector(state.intrinsics)
    predicted = _pixels(board_seen(state, arm.poses(grid)), _outline(views), intrinsics)
    moved = np.diff(_seen(views, state), axis=0)
    return _correlate(times, moved, grid, predicted, range_s)


def _seen(views: Sequence[StampedView], state: State) -> FloatArray:
    """Where the board's outline was in each image (m, 8)."""
    intrinsics = from_vector(state.intrinsics)
    poses = board_poses([view.board for view in views], intrinsics)
    return _pixels(poses, _outline(views), intrinsics)


def _correlate(
    times: FloatArray, moved: FloatArray, grid: FloatArray, predicted: FloatArray, range_s: float
) -> tuple[FloatArray, FloatArray]:
    """Lags that can be judged, and the normalised correlation at each of them."""
    lags, correlations = [], []
    channels = range(predicted.shape[1])
    for lag in np.arange(-range_s, range_s + _STEP_S / 2, _STEP_S):
        at = times - lag
        inside = (at >= grid[0]) & (at <= grid[-1])
        pairs = inside[1:] & inside[:-1]
        if pairs.sum() < _MIN_SHARE * len(moved):
            continue
        path = np.stack([np.interp(at, grid, predicted[:, c]) for c in channels], axis=1)
        a, b = moved[pairs], np.diff(path, axis=0)[pairs]
        size = np.sqrt(np.sum(a**2) * np.sum(b**2))
        # Lag and correlation are kept or left out together: no mask can set them apart.
        lags.append(float(lag))
        correlations.append(float(np.sum(a * b) / size) if size > 0.0 else 0.0)
    return np.array(lags), np.array(correlations)


def _peak(lags: FloatArray, correlations: FloatArray, speed: float, range_s: float) -> Coarse:
    best = int(np.argmax(correlations))
    height = float(correlations[best])
    if height < _MIN_CORRELATION:
        raise CalibrationError(
            f"the image does not move as the arm does (correlation {height:.2f} at best, within "
            f"± {range_s:.1f} s): repeat the hand-eye step, and check that nothing but the arm "
            "moved"
        )
    if best in (0, len(lags) - 1):
        raise CalibrationError(
            f"image and arm agree best at the edge of the range searched, {1e3 * lags[best]:.0f} "
            "ms: record the arm for longer on both sides and search a wider range"
        )
    rises = np.flatnonzero(
        (correlations[1:-1] >= correlations[:-2]) & (correlations[1:-1] >= correlations[2:])
    )
    peaks = rises + 1
    others = peaks[np.abs(lags[peaks] - lags[best]) > _SAME_PEAK_S]
    rival = max(others, key=lambda i: float(correlations[i]), default=None)
    if rival is not None and correlations[rival] > _AMBIGUOUS * height:
        raise CalibrationError(
            f"the motion repeats itself: {1e3 * lags[best]:.0f} ms and {1e3 * lags[rival]:.0f} ms "
            "fit alike. Wiggle at several frequencies at once"
        )
    left, right = correlations[best - 1], correlations[best + 1]
    bend = left - 2.0 * height + right
    shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return Coarse(float(lags[best] + shift * _STEP_S), height, speed)


def _outline(views: Sequence[StampedView]) -> FloatArray:
    """The corners (4, 3) of the rectangle around everything seen of the board."""
    points = np.concatenate([view.board.points_m for view in views])
    (x0, y0, _), (x1, y1, _) = points.min(axis=0), points.max(axis=0)
    return np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])


def _pixels(T_camera_board: FloatArray, points: FloatArray, intrinsics: Intrinsics) -> FloatArray:
    """Where the points (k, 3) appear from each pose: (m, 2k)."""
    p = points @ np.swapaxes(T_camera_board[:, :3, :3], 1, 2) + T_camera_board[:, None, :3, 3]
    p[..., 2] = np.maximum(p[..., 2], 1e-3)  # poses at far-off lags may be absurd
    return np.asarray(intrinsics.project(p).reshape(len(p), -1), dtype=float)
