"""A Kalman filter on (s, χ): exact, for both targets are linear given the measured twist."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.displacement import displacement
from estimator.estimate import Correction, Estimate
from estimator.gain import REST_SIGMA
from estimator.image.feature import Feature
from estimator.innovations import Innovations
from estimator.kalman_step import moved, seen
from estimator.models.model import Model
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]

# The radius lies outside the prior's range when χ̂ does by so many standard deviations.
_EXCLUDED_DEVIATIONS = 4.0


@dataclass(frozen=True, slots=True)
class RadiusPrior:
    """What is known of the radius beforehand: a guess, and a range it lies in."""

    guess_m: float
    low_m: float
    high_m: float

    def __post_init__(self) -> None:
        if not 0.0 < self.low_m <= self.guess_m <= self.high_m < math.inf:
            raise ValueError(
                f"a radius prior needs 0 < low <= guess <= high, not {self.low_m:g} m, "
                f"{self.guess_m:g} m, {self.high_m:g} m"
            )

    @property
    def chi(self) -> float:
        """χ̂ of the guess, in 1/m."""
        return 1.0 / self.guess_m

    @property
    def variance(self) -> float:
        """The mean square deviation from the guess of a χ that is anywhere in the range."""
        near, far = 1.0 / self.high_m, 1.0 / self.low_m
        return (far - near) ** 2 / 12.0 + (0.5 * (far + near) - self.chi) ** 2

    def excludes(self, chi: float, std: float) -> str:
        """Why χ̂ ± ``std`` is not what the range has led to expect; "" when it may be."""
        margin = _EXCLUDED_DEVIATIONS * std
        if 1.0 / self.high_m - margin <= chi <= 1.0 / self.low_m + margin:
            return ""
        return (
            f"the radius is outside the range it was said to lie in, {1e3 * self.low_m:g} to "
            f"{1e3 * self.high_m:g} mm"
        )


@dataclass(frozen=True, slots=True)
class TwistNoise:
    """Standard deviations of a measured twist, for arms that do not say theirs."""

    linear_m_s: float
    angular_rad_s: float

    @property
    def covariance(self) -> FloatArray:
        """(6, 6)."""
        return np.diag(np.repeat([self.linear_m_s**2, self.angular_rad_s**2], 3).astype(float))


@dataclass(frozen=True, slots=True)
class _State:
    t_s: float  # exposure instant of the last image used
    x: FloatArray  # (4,) s and χ
    P: FloatArray  # (4, 4)
    axis: FloatArray  # (3,) as that image showed it; zeros: none
    image_covariance: FloatArray  # (3, 3)
    residual: float


class KalmanFilter:
    """The optimal estimate of s and χ = 1/R from images and the measured twist, with its variance.

    Between images x moves by (12) or (20), integrated along the measured twist as exactly as
    that is known; the twist's noise makes s less certain. A cylinder's axis counts as known from
    each image. An image whose innovation exceeds its 99.99 % quantile is ignored; five in a row
    are believed again, χ̂ being kept, and are named a contradiction. Where innovations are
    larger than claimed, all variances are stated that much larger.

    ``time_std_s`` is how uncertain an image's instant is against the arm's stamps: an image is
    as much less certain as the target may have moved in it meanwhile.

    Slower than 1 mm/s the camera counts as standing and its images tell nothing new of χ.
    Raises ValueError for a model with other unknowns than a constant 1/R, such as points.
    """

    def __init__(
        self, model: Model, prior: RadiusPrior, noise: TwistNoise, time_std_s: float = 0.0
    ) -> None:
        if model.p != 1 or np.any(model.f_u(np.ones(model.m), np.ones(model.p), np.ones(6))):
            raise ValueError(
                "the Kalman filter is for one constant unknown: take an ExtendedKalmanFilter"
            )
        self._model = model
        self._prior = prior
        self._time_std_s = time_std_s
        self._noise = noise.covariance
        self._state: _State | None = None
        self._innovations = Innovations()
        # Compiles the kernels now rather than in the middle of a run.
        R, d = displacement(np.arange(2.0), np.zeros((2, 6)))
        still = np.zeros(6)
        x, P = moved(np.ones(4), np.eye(4), R, d, still[:3], self._noise, 1.0, REST_SIGMA)
        seen(x, P, still[:3], np.eye(3), still[:3])

    def correct(self, feature: Feature, t_s: float, motion: TwistHistory) -> Correction:
        """Move the state to ``t_s`` and use the feature; see ``Estimator``.

        Raises MotionUnknownError, with the state unchanged, when the motion at ``t_s`` is not
        known yet.
        """
        state = self._state
        near = None if state is None else np.concatenate((state.x[:3], state.axis))
        s, measured_axis = self._model.position_and_axis(self._model.measured(feature, near))
        axis = np.zeros(3) if measured_axis is None else measured_axis
        covariance = np.array(feature.covariance, dtype=float)  # as compiled code wants it
        if state is None:
            self._state = self._first(t_s, s, axis, covariance)
            return Correction.INITIALISED
        if t_s <= state.t_s:
            return Correction.STALE
        if len(motion) and not motion.covers(state.t_s) and motion.covers(t_s):
            self._restart(t_s, s, axis, covariance, state)
            return Correction.RESTARTED
        x, P, twist = self._moved(state, axis, t_s, motion)
        covariance += self._blur(x, axis, twist)
        after, P_after, nis = seen(x, P, s, covariance, axis)
        residual = float(np.linalg.norm(s - x[:3]))
        if not self._innovations.admits(float(nis), 3 if measured_axis is None else 2):
            if not self._innovations.persistent:
                return Correction.REJECTED
            self._restart(t_s, s, axis, covariance, state)
            return Correction.RESTARTED
        self._state = _State(t_s, after, P_after, axis, covariance, residual)
        return Correction.APPLIED

    @property
    def estimate(self) -> Estimate | None:
        """The state at the exposure of the last image used; None before the first image."""
        state = self._state
        if state is None:
            return None
        return self._answer(state, state.t_s, state.x, state.P, state.axis, 0.0)

    def predict(self, now_s: float, motion: TwistHistory) -> Estimate:
        """The target at ``now_s``, moved on with χ̂; see ``Estimator``."""
        state = self._state
        if state is None or not now_s >= state.t_s:
            raise ValueError(f"there is no image at or before {now_s:.6f} s to predict from")
        if now_s == state.t_s:
            return self._answer(state, now_s, state.x, state.P, state.axis, 0.0)
        window = motion.window(state.t_s, now_s)
        R, d = displacement(window.times_s, window.twists_camera)
        axis = R @ state.axis
        x, P = moved(
            *(state.x, state.P, R, d, axis, motion.spectrum(self._noise)),
            *(now_s - state.t_s, REST_SIGMA),
        )
        return self._answer(state, now_s, x, P, axis, window.extrapolated_s)

    def _moved(
        self, state: _State, axis: FloatArray, t_s: float, motion: TwistHistory
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The state and its covariance at the next image, and the twist (6,) there."""
        window = motion.window(state.t_s, t_s)
        R, d = displacement(window.times_s, window.twists_camera)
        x, P = moved(
            *(state.x, state.P, R, d, axis, motion.spectrum(self._noise)),
            *(t_s - state.t_s, REST_SIGMA),
        )
        return x, P, window.twists_camera[-1]

    def _blur(self, x: FloatArray, axis: FloatArray, twist: FloatArray) -> FloatArray:
        """What an uncertain instant adds to an image's covariance (3, 3): (12) or (20) times it."""
        v, omega = twist[:3], twist[3:]
        s_dot = np.cross(x[:3], omega) - x[3] * (v - axis * float(axis @ v))
        spread = self._time_std_s * s_dot
        return np.outer(spread, spread)

    def _first(self, t_s: float, s: FloatArray, axis: FloatArray, covariance: FloatArray) -> _State:
        x = np.append(s, self._prior.chi)
        return _State(t_s, x, _apart(covariance, self._prior.variance), axis, covariance, 0.0)

    def _restart(
        self, t_s: float, s: FloatArray, axis: FloatArray, covariance: FloatArray, state: _State
    ) -> None:
        x, P = np.append(s, state.x[3]), _apart(covariance, float(state.P[3, 3]))
        self._state = _State(t_s, x, P, axis, covariance, state.residual)
        self._innovations.restarted()

    def _answer(
        self,
        state: _State,
        t_s: float,
        x: FloatArray,
        P: FloatArray,
        axis: FloatArray,
        extrapolated_s: float,
    ) -> Estimate:
        factor = self._innovations.factor
        chi, variance = float(x[3]), factor * float(P[3, 3])
        return Estimate(
            t_s=t_s,
            s=x[:3].copy(),
            axis=axis.copy() if np.any(axis) else None,
            chi=chi,
            variance=variance,
            residual=state.residual,
            extrapolated_s=extrapolated_s,
            covariance=factor * P,
            image_covariance=factor * state.image_covariance,
            doubt=self._innovations.doubt or self._prior.excludes(chi, math.sqrt(variance)),
        )


def _apart(covariance: FloatArray, variance: float) -> FloatArray:
    """The covariance (4, 4) of an s and a χ that have nothing to do with each other."""
    P = np.zeros((4, 4))
    P[:3, :3], P[3, 3] = covariance, variance
    return P
