"""How late the images' stamps are against the arm's, from a wiggle in front of the board."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye_model import State
from rig.calibration.latency_coarse import coarse_latency
from rig.calibration.latency_refine import Segment, refine_latency
from rig.calibration.trajectory import Trajectory
from rig.calibration.views import StampedView

FloatArray = NDArray[np.float64]

_MIN_FRAMES = 30
_LARGEST_STD_S = 1e-3
_LEAST_STD_S = 2e-5  # stamps and interpolation are not believed to be better
_AGREE_SIGMAS = 3.5


@dataclass(frozen=True, slots=True)
class LatencyFit:
    """An image stamped t was exposed (half way) at t − latency_s on the arm's clock."""

    latency_s: float
    std_s: float
    segments: tuple[Segment, ...]
    correlation: float  # of measured and predicted image motion, the worst segment's
    speed_px_s: float  # rms image motion of the slowest segment
    row_time_s: float  # from one row to the next; 0 unless estimated
    row_time_std_s: float


def fit_latency(
    segments: Sequence[Sequence[StampedView]],
    arm: Trajectory,
    state: State,
    camera_covariance: FloatArray,
    height: int,
    rolling: bool = False,
    range_s: float = 0.5,
) -> LatencyFit:
    """Latency from two or more segments of motion, each of which determines it by itself.

    ``state`` and ``camera_covariance`` (6, 6, in camera axes) come from the hand-eye step,
    ``height`` is the image's, ``range_s`` how far off the stamps may be. With ``rolling`` the
    time from row to row is estimated too. Raises CalibrationError when the motion is too weak,
    repeats itself, or the segments disagree.
    """
    if len(segments) < 2:
        raise CalibrationError(
            f"{len(segments)} segment of motion: at least two are needed, one to check the other"
        )
    parts, coarse = [], []
    for number, views in enumerate(segments, start=1):
        if len(views) < _MIN_FRAMES:
            raise CalibrationError(
                f"segment {number} has {len(views)} images of the board, {_MIN_FRAMES} are "
                "needed: wiggle for longer, or by less so that the board stays in view"
            )
        first = coarse_latency(views, arm, state, range_s)
        part = refine_latency(
            views, arm, state, camera_covariance, first.latency_s, height, rolling
        )
        if part.std_s > _LARGEST_STD_S:
            raise CalibrationError(
                f"segment {number} determines the latency only to ± {1e3 * part.std_s:.1f} ms: "
                "wiggle faster or further"
            )
        coarse.append(first)
        parts.append(part)
    _check_agreement(parts)
    latency_s, std_s = _combined([p.latency_s for p in parts], [p.std_s for p in parts])
    row_s, row_std_s = 0.0, 0.0
    if rolling:
        row_s, row_std_s = _combined(
            [p.row_time_s for p in parts], [p.row_time_std_s for p in parts], least=0.0
        )
    return LatencyFit(
        latency_s=latency_s,
        std_s=std_s,
        segments=tuple(parts),
        correlation=min(one.correlation for one in coarse),
        speed_px_s=min(one.speed_px_s for one in coarse),
        row_time_s=row_s,
        row_time_std_s=row_std_s,
    )


def _check_agreement(parts: Sequence[Segment]) -> None:
    for (i, a), (j, b) in combinations(enumerate(parts, start=1), 2):
        allowed = _AGREE_SIGMAS * np.sqrt(a.std_s**2 + b.std_s**2 + 2.0 * _LEAST_STD_S**2)
        if abs(a.latency_s - b.latency_s) > allowed:
            raise CalibrationError(
                f"segments {i} and {j} disagree about the latency: "
                f"{1e3 * a.latency_s:.2f} ± {1e3 * a.std_s:.2f} ms and "
                f"{1e3 * b.latency_s:.2f} ± {1e3 * b.std_s:.2f} ms. The delay is not constant: "
                "check the camera's exposure and frame rate, the processor's load, and the clocks"
            )


def _combined(
    values: Sequence[float], stds: Sequence[float], least: float = _LEAST_STD_S
) -> tuple[float, float]:
    """Weighted mean and its standard deviation, widened when the values scatter by more."""
    x, s = np.array(values), np.hypot(stds, least)
    weight = 1.0 / s**2
    mean = float(np.sum(weight * x) / weight.sum())
    excess = float(np.sum(weight * (x - mean) ** 2)) / (len(x) - 1)
    return mean, float(np.sqrt(max(excess, 1.0) / weight.sum()))
