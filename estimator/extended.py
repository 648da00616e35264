"""An extended Kalman filter on the unknowns of any model of form (1): for points, to compare."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from estimator.estimate import Correction, Estimate
from estimator.flow import integrate, refine
from estimator.image.feature import Feature
from estimator.kalman import RadiusPrior, TwistNoise
from estimator.models.model import Model
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]

# Step of the differences that stand for Jacobians, as a share.
_STEP = 1e-5
# Least standard deviations, as shares: keeps what is inverted regular.
_FINEST = 1e-7


class ExtendedKalmanFilter:
    """State (s, χ) of a model, moved on by (1) and linearised by differences.

    An image is the s that its feature holds; the model says what that is at a state. Only for
    models without an axis. With the sphere's own model it is the linear filter, with
    ``LimbPlane`` the textbook's on three unknowns; for points, whose χ̇ has χ², it is what there
    is instead of an exact one. ``independent`` says that each unknown is as uncertain as
    ``prior`` on its own (several points), not all of them together (one target's). No image is
    refused and nothing is learnt from residuals.
    """

    def __init__(
        self, model: Model, prior: RadiusPrior, noise: TwistNoise, independent: bool = False
    ) -> None:
        self._model = model
        self._prior = prior
        self._independent = independent
        self._noise = noise.covariance
        self._t_s = 0.0
        self._x: FloatArray | None = None  # (m + p,)
        self._P = np.zeros((0, 0))
        self._residual = 0.0

    def correct(self, feature: Feature, t_s: float, motion: TwistHistory) -> Correction:
        """See ``Estimator``; raises MotionUnknownError, nothing being changed."""
        if self._x is None:
            self._begin(feature, t_s, self._prior.chi, self._prior.variance)
            return Correction.INITIALISED
        if t_s <= self._t_s:
            return Correction.STALE
        if len(motion) and not motion.covers(self._t_s) and motion.covers(t_s):
            now = self._answer(self._x, self._P, self._t_s, 0.0)
            self._begin(feature, t_s, now.chi, now.variance or self._prior.variance)
            return Correction.RESTARTED
        x, P, _ = self._moved(t_s, motion)
        H = _differences(self._seen, x)
        floor = (_FINEST * float(np.linalg.norm(feature.s))) ** 2
        covariance = feature.covariance + floor * np.eye(feature.s.size)
        innovation = feature.s - self._seen(x)
        gain = np.linalg.solve(H @ P @ H.T + covariance, H @ P).T
        left = np.eye(x.size) - gain @ H
        self._x, self._t_s = x + gain @ innovation, t_s
        self._P = left @ P @ left.T + gain @ covariance @ gain.T
        self._residual = float(np.linalg.norm(innovation))
        return Correction.APPLIED

    @property
    def estimate(self) -> Estimate | None:
        """The state at the last image's exposure; None before the first image."""
        return None if self._x is None else self._answer(self._x, self._P, self._t_s, 0.0)

    def predict(self, now_s: float, motion: TwistHistory) -> Estimate:
        """The target at ``now_s``; see ``Estimator``."""
        if self._x is None or not now_s >= self._t_s:
            raise ValueError(f"there is no image at or before {now_s:.6f} s to predict from")
        if now_s == self._t_s:
            return self._answer(self._x, self._P, now_s, 0.0)
        x, P, extrapolated_s = self._moved(now_s, motion)
        return self._answer(x, P, now_s, extrapolated_s)

    def _begin(self, feature: Feature, t_s: float, inverse: float, variance: float) -> None:
        s = self._model.measured(feature, None)
        chi = self._model.chi_of_guess(s, 1.0 / inverse)
        # From what the feature holds to the model's s, from 1/R to χ, which is in proportion to it.
        J = _differences(
            lambda seen: self._model.measured(Feature(seen, feature.covariance), None),
            np.array(feature.s, dtype=float),
        )
        spread = np.diag(chi**2) if self._independent else np.outer(chi, chi)
        m = s.size
        self._x, self._t_s = np.concatenate((s, chi)), t_s
        self._P = np.zeros((self._x.size, self._x.size))
        self._P[:m, :m] = J @ feature.covariance @ J.T
        self._P[m:, m:] = variance * spread / inverse**2
        self._P += np.diag((_FINEST * self._x) ** 2 + 1e-18)

    def _moved(self, t_s: float, motion: TwistHistory) -> tuple[FloatArray, FloatArray, float]:
        """The state, its covariance and the extrapolation at a later instant."""
        assert self._x is not None
        window = motion.window(self._t_s, t_s)
        times_s, twists = refine(window.times_s, window.twists_camera)
        m, x = self._model.m, self._x
        steps = _STEP * np.maximum(np.abs(x), 1e-3)
        starts = x + np.concatenate((np.zeros((1, x.size)), np.diag(steps)))
        s, chi = integrate(self._model, starts[:, :m], starts[:, m:], times_s, twists)
        ends = np.concatenate((s[:, -1], chi[:, -1]), axis=1)
        F = (ends[1:] - ends[0]).T / steps
        u = twists[-1]
        G = _differences(lambda twist: self._rates(ends[0], twist), u, 1e-3)
        Q = (t_s - self._t_s) * G @ motion.spectrum(self._noise) @ G.T
        return ends[0], F @ self._P @ F.T + Q, window.extrapolated_s

    def _rates(self, x: FloatArray, u: FloatArray) -> FloatArray:
        """(1), (m + p,)."""
        model, s, chi = self._model, x[: self._model.m], x[self._model.m :]
        s_dot = model.f_m(s, u) + model.Omega(s, u[:3]).T @ chi
        return np.concatenate((s_dot, model.f_u(s, chi, u)))

    def _seen(self, x: FloatArray) -> FloatArray:
        return self._model.shown(x[: self._model.m])

    def _answer(self, x: FloatArray, P: FloatArray, t_s: float, extrapolated_s: float) -> Estimate:
        m = self._model.m
        g = _differences(
            lambda at: np.array([self._model.inverse_radius(at[:m], at[m:])]), x
        )  # fmt: skip
        inverse = self._model.inverse_radius(x[:m], x[m:])
        variance = float((g @ P @ g.T)[0, 0])
        position, _ = self._model.position_and_axis(x[:m])
        return Estimate(
            *(t_s, position, None, inverse, variance, self._residual, extrapolated_s),
            state=x[:m].copy(),
            unknowns=x[m:].copy(),
        )


def _differences(
    function: Callable[[FloatArray], FloatArray], x: FloatArray, least: float = 1e-3
) -> FloatArray:
    """The Jacobian (n, k) of ``function`` at x (k,) by central differences."""
    steps = _STEP * np.maximum(np.abs(x), least)
    columns = [
        (function(x + step) - function(x - step)) / (2.0 * size)
        for step, size in zip(np.diag(steps), steps, strict=True)
    ]
    return np.stack(columns, axis=1)
