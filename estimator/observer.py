"""The observer (2), moved from image to image so that its error obeys (5) exactly."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.estimate import Correction, Estimate
from estimator.flow import integrate, refine
from estimator.gain import REST_SIGMA, damping_rates, rest_rates
from estimator.image.feature import Feature
from estimator.models.model import Model
from estimator.second_order import exact_step
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]

# Two images between which the motion all but returned to its start say little about χ: what
# the images before them said weighs in with this share of the most they could have said.
_RETURN_GUARD = 1e-4


@dataclass(frozen=True, slots=True)
class _State:
    t_s: float  # exposure instant of the last image
    s: FloatArray  # (m,) measured there
    chi: FloatArray  # (p,) χ̂
    z: FloatArray  # (p,) χ − χ̂ as the images so far have it
    w: FloatArray  # (p,) Ω ξ
    rest_s: FloatArray  # (p,) how long each σ_i has been that of a standing camera
    residual: float


@dataclass(frozen=True, slots=True)
class _Interval:
    """What two images say about the time between them, at the nodes of the measured twist."""

    steps_s: FloatArray  # (n-1,)
    Omega: FloatArray  # (n-1, p, m) at the middle of each step
    transitions: FloatArray  # (n-1, p, p) of a deviation of χ over each step
    z: FloatArray  # (p,) χ − χ̂ at the start that explains the second image
    chi_end: FloatArray  # (p,) χ at the end that goes with it
    unexplained: FloatArray  # (m,) rate of s that no χ explains
    residual: float  # norm of what the second image contradicts the prediction by


class Observer:
    """The paper's observer (2) with H of ``estimator.gain``, for any model of the form (1).

    In the coordinate w = Ω ξ, ξ = s − ŝ, (2) reads ẇ = −C w + Ω (ṡ − f_m − Ωᵀ χ̂) and
    χ̂' = f_u + α w. H's terms in Ω̇ are what keeps w while Ω changes, so no derivative of a
    measured twist is ever formed and nothing is divided by σ; the part of ξ that is orthogonal
    to Ω's rows does not act on χ̂ and is not kept. ŝ = s − Ω⁺ w is implied.

    Once the useful speed (σ) has stayed below 1 mm/s for a moment the camera counts as standing
    and χ̂ is held, see ``rest_rates``. ``alpha`` is the paper's gain, ``damping`` a multiple of
    the critical c*. Raises ValueError for a gain or a guess that is not positive.
    """

    def __init__(self, model: Model, alpha: float, damping: float, radius_guess_m: float) -> None:
        for name, value in (
            ("alpha", alpha),
            ("damping", damping),
            ("radius_guess_m", radius_guess_m),
        ):
            if not (np.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} must be a positive number, not {value!r}")
        self._model = model
        self._alpha = alpha
        self._damping = damping
        self._radius_guess_m = radius_guess_m
        self._state: _State | None = None
        # Compiles the model's kernels now rather than in the middle of a run.
        still = np.zeros((2, 6))
        s, _ = model.flow(np.zeros((1, model.m)), np.zeros((1, model.p)), np.arange(2.0), still)
        model.structures(s[0], still)

    def correct(self, feature: Feature, t_s: float, motion: TwistHistory) -> Correction:
        """Move the state to ``t_s``, the exposure instant of the image ``feature`` came from.

        The first image sets ŝ = s and χ̂ from the guess. An image not later than the last one
        is ignored. When the motion since the last image is no longer recorded, χ̂ is kept and
        ŝ = s. Raises MotionUnknownError, with the state unchanged, when the motion at ``t_s``
        is not known yet.
        """
        state = self._state
        s = self._model.measured(feature, None if state is None else state.s)
        if state is None:
            chi = self._model.chi_of_guess(s, self._radius_guess_m)
            self._state = _at_rest(t_s, s, chi, 0.0)
            return Correction.INITIALISED
        if t_s <= state.t_s:
            return Correction.STALE
        if len(motion) and not motion.covers(state.t_s) and motion.covers(t_s):
            self._state = _at_rest(t_s, s, state.chi, state.residual)
            return Correction.RESTARTED
        window = motion.window(state.t_s, t_s)
        interval = _explain(self._model, state, s, *refine(window.times_s, window.twists_camera))
        z, w, rest_s = self._error_after(interval, state)
        self._state = _State(t_s, s, interval.chi_end - z, z, w, rest_s, interval.residual)
        return Correction.APPLIED

    @property
    def estimate(self) -> Estimate | None:
        """The state at the last image's exposure; None before the first image."""
        state = self._state
        return None if state is None else self._answer(state.t_s, state.s, state.chi, 0.0)

    def predict(self, now_s: float, motion: TwistHistory) -> Estimate:
        """The target at ``now_s``, integrated with χ̂ from the last image; changes nothing.

        Raises ValueError before the first image or for an earlier instant than its exposure,
        and MotionUnknownError when the arm's motion is not known up to ``now_s``.
        """
        state = self._state
        if state is None or not now_s >= state.t_s:
            raise ValueError(f"there is no image at or before {now_s:.6f} s to predict from")
        if now_s == state.t_s:
            return self._answer(now_s, state.s, state.chi, 0.0)
        window = motion.window(state.t_s, now_s)
        nodes = window.times_s, window.twists_camera
        s, chi = integrate(self._model, state.s[None], state.chi[None], *nodes)
        return self._answer(now_s, s[0, -1], chi[0, -1], window.extrapolated_s)

    def _answer(
        self, t_s: float, s: FloatArray, chi: FloatArray, extrapolated_s: float
    ) -> Estimate:
        state = self._state
        residual = 0.0 if state is None else state.residual
        position, axis = self._model.position_and_axis(s)
        inverse = self._model.inverse_radius(s, chi)
        return Estimate(
            *(t_s, position.copy(), axis, inverse, None, residual, extrapolated_s),
            state=s.copy(),
            unknowns=chi.copy(),
        )

    def _error_after(
        self, interval: _Interval, state: _State
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """z, w and the time at rest at the interval's end: exact steps of (5), Ω frozen in each."""
        A, b, rest_s = self._steps(interval, state.rest_s)
        error = np.concatenate((interval.z, state.w))
        for A_step, b_step in zip(A, b, strict=True):
            error = A_step @ error + b_step
        return error[: state.w.size], error[state.w.size :], rest_s

    def _steps(
        self, interval: _Interval, rest_s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Steps (z, w) -> A (z, w) + b: A (n-1, 2p, 2p), b (n-1, 2p); the time at rest after."""
        Omega, h = interval.Omega, interval.steps_s[:, None]
        squares, U = np.linalg.eigh(Omega @ Omega.swapaxes(1, 2))
        sigma2 = np.maximum(squares, 0.0)
        sigma = np.sqrt(sigma2)
        forgetting, rest_s = rest_rates(sigma, interval.steps_s, rest_s)
        c = damping_rates(sigma, self._alpha, self._damping) + forgetting
        step = exact_step(self._alpha, sigma2, c, h)
        zz, zw, wz, ww = ((U * entry[:, None, :]) @ U.swapaxes(1, 2) for entry in step)
        p = rest_s.size
        A = np.empty((h.size, 2 * p, 2 * p))
        A[:, :p, :p], A[:, :p, p:] = zz @ interval.transitions, zw
        A[:, p:, :p], A[:, p:, p:] = wz @ interval.transitions, ww
        # What no χ explains enters w half before, half after each step.
        kick = 0.5 * h * (Omega @ interval.unexplained)
        b = (A[:, :, p:] @ kick[:, :, None])[:, :, 0]
        b[:, p:] += kick
        return A, b, rest_s


def _at_rest(t_s: float, s: FloatArray, chi: FloatArray, residual: float) -> _State:
    none = np.zeros_like(chi)
    return _State(t_s, s, chi, none, none, none, residual)


def _explain(
    model: Model, state: _State, s_end: FloatArray, times_s: FloatArray, twists: FloatArray
) -> _Interval:
    """Interpolate s between two images with the model.

    s is integrated from the first image with χ̂; the mismatch B z at the second says which χ
    = χ̂ + z the images agree on, and with it s in between. What no z explains (noise) is spread
    evenly. Without noise and with a model linear in χ this is s exactly. Where B vanishes (the
    camera stands, or returns to its start) z is what the images before said.
    """
    p, duration_s = state.chi.size, times_s[-1] - times_s[0]
    # Sensitivities by differences: exact for a linear model, first order for any other.
    delta = 1e-3 * max(1.0, float(np.abs(state.chi).max()))
    chi0 = state.chi + np.concatenate((np.zeros((1, p)), delta * np.eye(p)))
    s0 = np.repeat(state.s[None], p + 1, axis=0)
    s, chi = integrate(model, s0, chi0, times_s, twists)
    B = (s[1:] - s[0]).transpose(1, 2, 0) / delta  # (n, m, p)
    transition = (chi[1:] - chi[0]).transpose(1, 2, 0) / delta  # (n, p, p) from the start

    mismatch = s_end - s[0, -1]
    steps_s = np.diff(times_s)
    Omega = model.structures(s[0], twists)
    # |B|² can reach T ∫|Ω|² and falls short of it as the motion turns back on itself.
    reach = duration_s * float(steps_s @ (Omega[1:] ** 2).sum(axis=(1, 2)))
    guard = _RETURN_GUARD * reach / p + (REST_SIGMA * duration_s) ** 2
    news = B[-1].T @ (mismatch - B[-1] @ state.z)
    z = state.z + np.linalg.solve(B[-1].T @ B[-1] + guard * np.eye(p), news)
    unexplained = (mismatch - B[-1] @ z) / duration_s

    elapsed = (times_s - times_s[0])[:, None]
    s_between = s[0] + (B @ z) + elapsed * unexplained
    Omega = model.structures(s_between, twists)
    return _Interval(
        steps_s=steps_s,
        Omega=0.5 * (Omega[1:] + Omega[:-1]),
        transitions=transition[1:] @ np.linalg.inv(transition[:-1]),
        z=z,
        chi_end=chi[0, -1] + transition[-1] @ z,
        unexplained=unexplained,
        residual=float(np.linalg.norm(mismatch)),
    )
