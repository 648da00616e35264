"""The Kalman filter with more unknowns: when images were exposed, and the arm's true speed."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.augmented_step import (
    CHI,
    KAPPA,
    TAU,
    AugmentedState,
    Image,
    Point,
    first_state,
    next_state,
)
from estimator.displacement import displacement
from estimator.estimate import Correction, Estimate
from estimator.gain import REST_SIGMA
from estimator.image.feature import Feature
from estimator.innovations import Innovations
from estimator.kalman import RadiusPrior, TwistNoise
from estimator.kalman_step import moved
from estimator.models.model import Model
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]

# So many images are gone through again while what they tell changes.
_REMEMBERED = 120
# Of a standard deviation: what was linearised so far off is linearised anew.
_TOO_FAR = 0.5
# A deviation that fell to this share of its prior was found, not assumed.
_FOUND = 0.5


@dataclass(frozen=True, slots=True)
class ExtraPrior:
    """Standard deviations of the optional states beforehand; 0: the state is known, not sought."""

    time_offset_s: float = 0.0
    speed_scale: float = 0.0


@dataclass(frozen=True, slots=True)
class ExtraState:
    """An optional state as the images and the motion have it."""

    name: str
    value: float
    std: float
    observable: bool  # in this run; otherwise the value is little more than what was assumed


class AugmentedKalmanFilter:
    """A ``KalmanFilter`` that also seeks τ, by which stamps of images are late, and κ.

    κ is by what the arm's measured twist is to be multiplied, all of it, as from a controller
    whose clock is off. (A scale of the linear velocity alone no motion can tell from the radius.)
    In τ and κ the target is not linear: the images of the first seconds are filtered again, about
    the newest estimate, until that stays where it is, and what comes later about the last one.
    (Were each image linearised about an estimate of its own, they would seem to tell what they
    do not.) An interval of R contains what τ and κ leave open.
    """

    def __init__(
        self,
        model: Model,
        prior: RadiusPrior,
        noise: TwistNoise,
        extra: ExtraPrior,
        time_std_s: float = 0.0,
    ) -> None:
        self._model = model
        self._prior = prior
        self._noise = noise.covariance
        self._extra = extra
        self._time_std_s = time_std_s
        self._state: AugmentedState | None = None
        self._stamp_s = -math.inf  # of the last image used
        self._point = Point(prior.chi, 0.0, 1.0)
        self._first_images: list[Image] | None = []
        self._innovations = Innovations()

    def correct(self, feature: Feature, t_s: float, motion: TwistHistory) -> Correction:
        """Use the feature of the image stamped ``t_s``; see ``Estimator``.

        Raises MotionUnknownError, with the state unchanged, when the motion at ``t_s`` is not
        known yet.
        """
        state = self._state
        near = None if state is None else np.concatenate((state.x[:3], state.axis))
        s, axis = self._model.position_and_axis(self._model.measured(feature, near))
        image = Image(t_s, s, np.zeros(3) if axis is None else axis, feature.covariance)
        if state is None:
            self._begin(image, self._prior_covariance(), motion)
            return Correction.INITIALISED
        if t_s <= self._stamp_s:
            return Correction.STALE
        if len(motion) and not motion.covers(state.t_s) and motion.covers(t_s):
            return self._restart(image, motion)
        motion.at(t_s)  # known, or the caller has to wait
        before = state, self._point
        after, nis = self._used(state, image, motion)
        if not self._innovations.admits(nis, 3 if axis is None else 2):
            self._state, self._point = before
            if self._innovations.persistent:
                return self._restart(image, motion)
            return Correction.REJECTED
        self._state, self._stamp_s = after, t_s
        if self._first_images is not None:
            self._first_images.append(image)
            if len(self._first_images) >= _REMEMBERED:
                self._first_images = None
        return Correction.APPLIED

    @property
    def estimate(self) -> Estimate | None:
        """The state at what is now known to be the exposure of the last image used."""
        state = self._state
        if state is None:
            return None
        return self._answer(state, state.t_s, state.x[:4], state.P[:4, :4], state.axis, 0.0)

    def predict(self, now_s: float, motion: TwistHistory) -> Estimate:
        """The target at ``now_s``, moved on with χ̂ and κ̂; see ``Estimator``."""
        state = self._state
        if state is None or not now_s >= state.t_s:
            raise ValueError(f"there is no image at or before {now_s:.6f} s to predict from")
        if now_s == state.t_s:
            return self._answer(state, now_s, state.x[:4], state.P[:4, :4], state.axis, 0.0)
        window = motion.window(state.t_s, now_s)
        R, d = displacement(window.times_s, float(state.x[KAPPA]) * window.twists_camera)
        axis = R @ state.axis
        P = np.ascontiguousarray(state.P[:4, :4])
        x, P = moved(
            *(state.x[:4].copy(), P, R, d, axis, motion.spectrum(self._noise)),
            *(now_s - state.t_s, REST_SIGMA),
        )
        return self._answer(state, now_s, x, P, axis, window.extrapolated_s)

    @property
    def extra_states(self) -> tuple[ExtraState, ...]:
        """The optional states that are sought; empty before the first image."""
        if self._state is None:
            return ()
        x, P = self._state.x, self._innovations.factor * self._state.P
        sought = (
            ("time_offset", TAU, self._extra.time_offset_s),
            ("speed_scale", KAPPA, self._extra.speed_scale),
        )
        return tuple(
            ExtraState(
                name, float(x[at]), std := math.sqrt(float(P[at, at])), std < _FOUND * before
            )
            for name, at, before in sought
            if before > 0.0
        )

    def _used(
        self, state: AugmentedState, image: Image, motion: TwistHistory
    ) -> tuple[AugmentedState, float]:
        """The state after an image, and that image's normalised innovation squared."""
        first = self._first_images
        after, nis = self._step(state, image, motion)
        if first is None:
            return after, nis
        if not motion.covers(first[0].t_s):
            self._first_images = None
            return after, nis
        # Once an image, for the time it takes: what is then still off is left to the next.
        if _far(self._point, after):
            self._point = _point_of(after)
            after = self._started(first[0], self._prior_covariance(), motion)
            for again in (*first[1:], image):
                after, nis = self._step(after, again, motion)
        return after, nis

    def _step(
        self, state: AugmentedState, image: Image, motion: TwistHistory
    ) -> tuple[AugmentedState, float]:
        return next_state(state, image, self._point, motion, self._noise, self._time_std_s)

    def _prior_covariance(self) -> FloatArray:
        """(3, 3) of χ, τ and κ."""
        extra = self._extra
        return np.diag([self._prior.variance, extra.time_offset_s**2, extra.speed_scale**2])

    def _started(
        self, image: Image, covariance: FloatArray, motion: TwistHistory
    ) -> AugmentedState:
        unknowns = np.array([self._prior.chi, 0.0, 1.0])
        return first_state(image, unknowns, covariance, self._point, motion)

    def _begin(self, image: Image, covariance: FloatArray, motion: TwistHistory) -> None:
        self._state = self._started(image, covariance, motion)
        self._stamp_s, self._first_images = image.t_s, [image]

    def _restart(self, image: Image, motion: TwistHistory) -> Correction:
        """Believe the image again, keeping what is known of χ, τ and κ."""
        assert self._state is not None
        old = self._state
        self._point = _point_of(old)
        state = first_state(image, old.x[CHI:], old.P[CHI:, CHI:], self._point, motion)
        self._state = replace(state, residual=old.residual)
        self._stamp_s, self._first_images = image.t_s, None
        self._innovations.restarted()
        return Correction.RESTARTED

    def _answer(
        self,
        state: AugmentedState,
        t_s: float,
        x: FloatArray,
        P: FloatArray,
        axis: FloatArray,
        extrapolated_s: float,
    ) -> Estimate:
        factor = self._innovations.factor
        chi, variance = float(x[CHI]), factor * float(P[CHI, CHI])
        excluded = self._prior.excludes(chi, math.sqrt(variance))
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
            doubt=self._innovations.doubt or excluded,
        )


def _point_of(state: AugmentedState) -> Point:
    return Point(*(float(value) for value in state.x[CHI:]))


def _far(point: Point, state: AugmentedState) -> bool:
    """Whether the estimate has left the point that it was linearised about."""
    off = np.abs(state.x[CHI:] - (point.chi, point.tau_s, point.kappa))
    return bool(np.any(off > _TOO_FAR * np.sqrt(np.diag(state.P)[CHI:]) + 1e-9))
