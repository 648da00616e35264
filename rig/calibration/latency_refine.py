"""The time offset between images and arm by least reprojection error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibration.hand_eye_model import BOARD, CAMERA, State, linearise
from rig.calibration.robust_fit import normal_equations, robust_fit, weights
from rig.calibration.trajectory import Trajectory
from rig.calibration.views import Stack, StampedView

FloatArray = NDArray[np.float64]

_BLOCK_S = 0.3  # residuals further apart than this are taken for independent
_ROW_SCALE_S = 1e-5  # makes a row's time a number like the others
# Unknowns: latency, time per row, then small motions of camera (6) and board (6).
_UNKNOWNS = 14


@dataclass(frozen=True, slots=True)
class Segment:
    """What one segment of the motion says."""

    latency_s: float
    std_s: float
    row_time_s: float
    row_time_std_s: float
    rms_px: float  # rms distance of the corners
    frames: int


@dataclass(frozen=True, slots=True)
class _Corners:
    """Every corner of every frame by itself: with a rolling shutter each has its own instant."""

    stack: Stack  # (m, 1, ...)
    times_s: FloatArray  # (m,) stamp of the image
    rows: FloatArray  # (m,) row, counted from the middle
    blocks: NDArray[np.intp]  # (m,)


def refine_latency(
    views: Sequence[StampedView],
    arm: Trajectory,
    state: State,
    camera_covariance: FloatArray,
    start_s: float,
    height: int,
    rolling: bool,
) -> Segment:
    """Latency near ``start_s`` (and, if ``rolling``, the time per row) from one segment.

    The board may move a little, the camera on the tool within ``camera_covariance`` (6, 6):
    an imperfect hand-eye step must not be taken for time. The standard deviation holds for
    errors that last up to a third of a second.
    """
    every = _split(views, height)
    times = every.times_s - start_s
    inside = arm.holds(times - 0.03) & arm.holds(times + 0.03)
    every = _only(every, inside)
    free = np.ones(_UNKNOWNS, dtype=bool)
    free[1] = rolling
    root = np.zeros((6, _UNKNOWNS))
    root[:, 2:8] = np.linalg.inv(np.linalg.cholesky(camera_covariance + 1e-18 * np.eye(6)))
    values = np.zeros(_UNKNOWNS)
    values[0] = start_s
    sigma_px = 1.0
    for _ in range(2):

        def evaluate(at: FloatArray, sigma: float = sigma_px) -> tuple[FloatArray, FloatArray]:
            off, J = _linear(every, arm, state, at)
            rows = np.concatenate([J / sigma, root])[:, free]
            return np.append(off / sigma, -root @ at), rows

        values = robust_fit(values, evaluate, lambda at, step: at + _full(step, free))
        off, J = _linear(every, arm, state, values)
        sigma_px = max(1.4826 * float(np.median(np.abs(off))), 1e-3)
    prior = (root.T @ root)[np.ix_(free, free)]
    covariance = _covariance(off / sigma_px, J[:, free] / sigma_px, every.blocks, prior)
    std = _full(np.sqrt(np.diag(covariance)), free)
    return Segment(
        latency_s=float(values[0]),
        std_s=float(std[0]),
        row_time_s=float(values[1]) * _ROW_SCALE_S,
        row_time_std_s=float(std[1]) * _ROW_SCALE_S,
        rms_px=float(np.sqrt(2.0 * np.mean(off**2))),
        frames=len(np.unique(every.times_s)),
    )


def _split(views: Sequence[StampedView], height: int) -> _Corners:
    points = np.concatenate([view.board.points_m for view in views])
    pixels = np.concatenate([view.board.pixels for view in views])
    times = np.concatenate([np.full(len(view.board), view.t_s) for view in views])
    corners = Stack(points[:, None], pixels[:, None], np.ones((len(points), 1)))
    blocks = ((times - times[0]) / _BLOCK_S).astype(np.intp)
    return _Corners(corners, times, pixels[:, 1] - (height - 1) / 2, blocks)


def _only(every: _Corners, which: NDArray[np.bool_]) -> _Corners:
    return _Corners(
        every.stack.only(which), every.times_s[which], every.rows[which], every.blocks[which]
    )


def _full(short: FloatArray, free: NDArray[np.bool_]) -> FloatArray:
    values = np.zeros(_UNKNOWNS)
    values[free] = short
    return values


def _linear(
    every: _Corners, arm: Trajectory, state: State, values: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Residuals (2m,) and derivatives of the prediction (2m, 14)."""
    step = np.zeros(22)
    step[CAMERA], step[BOARD] = values[2:8], values[8:14]
    times = every.times_s - values[0] + values[1] * _ROW_SCALE_S * every.rows
    times = np.clip(times, arm.start_s + 0.01, arm.end_s - 0.01)
    got = linearise(state.moved(step), arm.poses(times), every.stack)
    by_time = (got.by_arm @ arm.twists(times)[..., None])[..., 0]  # (m, 2)
    J = np.empty((len(times), 2, _UNKNOWNS))
    J[..., 0] = -by_time
    J[..., 1] = by_time * (every.rows * _ROW_SCALE_S)[:, None]
    J[..., 2:8], J[..., 8:14] = got.by_step[..., CAMERA], got.by_step[..., BOARD]
    return got.residuals.ravel(), J.reshape(-1, _UNKNOWNS)


def _covariance(
    r: FloatArray, J: FloatArray, blocks: NDArray[np.intp], prior: FloatArray
) -> FloatArray:
    """The larger of the fit's own and the one by the scatter of blocks of time."""
    inverse = np.linalg.inv(normal_equations(r, J)[0] + prior)
    pulls = np.zeros((int(blocks.max()) + 1, J.shape[1]))
    np.add.at(pulls, np.repeat(blocks, 2), J * (weights(r) * r)[:, None])
    used = len(np.unique(blocks))
    scatter = inverse @ (pulls.T @ pulls) @ inverse * (used / max(used - J.shape[1] / 6, 1.0))
    ratio = np.sqrt(np.maximum(np.diag(scatter) / np.diag(inverse), 1.0))
    return np.asarray(inverse * np.outer(ratio, ratio), dtype=float)
