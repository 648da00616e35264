"""What the calibration limits a run's radius to: its deviations, carried through the estimate."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.estimate import Estimator
from estimator.image.feature import Feature
from estimator.image.intrinsics import Intrinsics
from estimator.image.other_lens import through_other_lens
from estimator.twist_history import TwistHistory
from rig.calibration import se3
from rig.calibration.projection import from_vector, to_vector
from rig.calibration.spread import CAMERA, INTRINSICS, LATENCY, UNKNOWNS
from rig.config import RigConfig, TargetKind
from rig.frames import invert, twist_map
from rig.run_data import RunData

FloatArray = NDArray[np.float64]
MakeEstimator = Callable[[RigConfig, TargetKind], Estimator]

_LAST_S = 8.0  # of the run that are estimated again: what was before is long forgotten
_FEATURE_VARIANCE = 1e-8  # of s; only its being the same for all images matters
_PARTS = {
    "hand_eye": np.arange(CAMERA.start, CAMERA.stop),
    "focal_length": np.arange(INTRINSICS.start, INTRINSICS.start + 2),
    "lens": np.arange(INTRINSICS.start + 2, INTRINSICS.stop),  # principal point and distortion
    "latency": np.array([LATENCY]),
}


@dataclass(frozen=True, slots=True)
class CalibrationLimits:
    """Standard deviations of the radius, m.

    ``parts_m`` holds what each part of the calibration does by itself; ``total_m`` is less or
    more than their sum of squares, as errors of the parts are correlated.
    """

    total_m: float
    parts_m: dict[str, float]


def calibration_limits(
    data: RunData,
    config: RigConfig,
    intrinsics: Intrinsics,
    covariance: FloatArray,
    make: MakeEstimator,
) -> CalibrationLimits | None:
    """Estimate the radius again from what was measured, with each calibrated value a little off.

    ``make`` makes the run's estimator anew. ``covariance`` (16, 16) is of a step as in
    ``rig.calibration.spread``. None when the run gave no radius to limit.
    """
    if data.newest_snapshot is None or len(data.updates) < 2:
        return None
    again = _Again(data, config, intrinsics, make)
    base_m = again.radius_m(np.zeros(UNKNOWNS))
    steps = np.sqrt(np.diag(covariance))
    slope = np.zeros(UNKNOWNS)
    for index in np.flatnonzero(steps > 0.0):
        moved_m = again.radius_m(steps[index] * np.eye(UNKNOWNS)[index])
        slope[index] = (moved_m - base_m) / steps[index]
    if not np.all(np.isfinite(slope)):
        return None
    parts = {
        name: float(np.sqrt(slope[own] @ covariance[np.ix_(own, own)] @ slope[own]))
        for name, own in _PARTS.items()
    }
    return CalibrationLimits(float(np.sqrt(slope @ covariance @ slope)), parts)


class _Again:
    """The last seconds of a run, to be estimated with a slightly different calibration."""

    def __init__(
        self, data: RunData, config: RigConfig, intrinsics: Intrinsics, make: MakeEstimator
    ) -> None:
        assert data.newest_snapshot is not None  # there is an image, or nothing to estimate
        track = data.update_track()
        first = int(np.searchsorted(track.t_s, track.t_s[-1] - _LAST_S))
        self._t_s, self._s = track.t_s[first:], track.s[first:]
        self._axis = None if track.axis is None else track.axis[first:]
        self._arm_t_s = np.array([state.t_s for state in data.arm_states])
        self._twists = np.array([state.twist_tool for state in data.arm_states])
        self._T_tool_camera = data.T_tool_camera
        self._intrinsics = intrinsics
        height, width = data.newest_snapshot.image.shape
        self._size = (width, height)
        self._target, self._make = data.target, make
        self._config = config
        if first > 0 and track.chi[first] > 0.0:  # it goes on from where the run was
            guess = config.estimator.model_copy(update={"radius_guess_m": 1.0 / track.chi[first]})
            self._config = config.model_copy(update={"estimator": guess})

    def radius_m(self, step: FloatArray) -> float:
        """The radius at the end when the calibration is off by ``step`` (16,); nan: none."""
        T_tool_camera = self._T_tool_camera @ se3.exp(step[CAMERA])
        motion = TwistHistory(span_s=float("inf"), max_extrapolation_s=1.0)
        motion.extend(self._arm_t_s, self._twists @ twist_map(invert(T_tool_camera)).T)
        s, axis = self._s, self._axis
        if np.any(step[INTRINSICS]):
            other = from_vector(to_vector(self._intrinsics) + step[INTRINSICS])
            s, axis = through_other_lens(s, axis, self._intrinsics, other, self._size)
        estimator = self._make(self._config, self._target)
        covariance = _FEATURE_VARIANCE * np.eye(3)
        for k, t_s in enumerate(self._t_s - step[LATENCY]):
            feature = Feature(s[k], covariance, None if axis is None else axis[k])
            estimator.correct(feature, float(t_s), motion)
        estimate = estimator.estimate
        radius_m = None if estimate is None else estimate.radius_m
        return float("nan") if radius_m is None else radius_m
