"""Equation (24) for any model: v keeps its norm and climbs σ1², the least eigenvalue of Ω Ωᵀ."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimator.active.spectrum import (
    Spectrum,
    least_sigma2,
    spectrum,
    structure_along,
    structure_by_v,
)
from estimator.estimate import Estimate
from estimator.models.model import Model

FloatArray = NDArray[np.float64]

# σ1 below this share of what other directions would make of it: v is given a push, as in
# ``policy``.
_ESCAPE_SHARE = 0.01
# Largest product of a gain and an integration step, and the most steps in one call.
_MAX_GAIN_STEP = 0.2
_MOST_STEPS = 20
# How much faster than the gain itself the climb may change near equal eigenvalues.
_KINK = 10.0


class GradientPolicy:
    """v̇ = k1 (κ_des − κ) v / ‖v‖² + k2 (I − v vᵀ/‖v‖²)(J_vᵀ − J_v† min(J_s ṡ, 0)), κ = ‖v‖²/2.

    For points, a limb plane and whatever else has p unknowns; ``PaperPolicy`` is the law as
    printed for a sphere or a cylinder, compiled. J_v and J_s are those of the smooth σ1² of
    ``least_sigma2``; ṡ is what the model makes of the newest estimate. A ṡ that raises σ1² by
    itself is not undone, unlike in print: that can keep a camera which goes towards a point,
    while it turns to centre the target, on its way for as long as it goes. Where σ1 vanishes (v
    towards a point, say) J_v vanishes too, and v is pushed to where the unknown that is lost
    shows most. The maximum is that of the neighbourhood. Gains too large for the steps of
    ``advance`` count as the largest they can follow. Before an estimate with a state v stays as
    it is.
    Raises ValueError for v0 = 0 or a negative gain.
    """

    def __init__(self, model: Model, v0: ArrayLike, k1: float, k2: float) -> None:
        self._model = model
        self._v = np.array(v0, dtype=float)
        self._kappa_des = 0.5 * float(self._v @ self._v)
        if self._v.shape != (3,) or not 0.0 < self._kappa_des < math.inf:
            raise ValueError(f"GradientPolicy needs a velocity v0 that is not zero, not {v0!r}")
        if not (k1 >= 0.0 and k2 >= 0.0 and math.isfinite(k1 + k2)):
            raise ValueError(f"the gains of (24) must not be negative: k1 = {k1}, k2 = {k2}")
        self._k1 = float(k1)
        self._k2 = float(k2)
        self._s: FloatArray | None = None
        self._chi = np.zeros(model.p)

    @property
    def v(self) -> FloatArray:
        """The velocity (3,) wanted now, in m/s."""
        return self._v.copy()

    def inform(self, estimate: Estimate) -> None:
        """Take s and χ̂ from the newest estimate."""
        if estimate.state is not None and estimate.unknowns is not None:
            self._s, self._chi = estimate.state, estimate.unknowns

    def advance(self, axis: FloatArray | None, omega: FloatArray, dt_s: float) -> None:
        """Integrate over ``dt_s`` at the newest s while the camera turns at ω (3,)."""
        if self._s is None:
            return
        B = structure_by_v(self._model, self._s)
        B_dot = structure_along(self._model, self._s, self._s_dot(self._v, omega))
        curving = _KINK * _gain(spectrum(B @ self._v), B) ** 2
        fastest = max(self._k1, self._k2 * curving, math.hypot(*omega))
        steps = min(max(1, math.ceil(dt_s * fastest / _MAX_GAIN_STEP)), _MOST_STEPS)
        most = _MAX_GAIN_STEP * steps / max(dt_s, 1e-9)
        gains = min(self._k1, most), min(self._k2, most / max(curving, 1e-9))
        for _ in range(steps):
            half = self._v + 0.5 * dt_s / steps * self._rate(self._v, B, B_dot, gains)
            self._v = self._v + dt_s / steps * self._rate(half, B, B_dot, gains)

    def v_dot(self, v: FloatArray, omega: FloatArray) -> FloatArray:
        """v̇ (3,) at v (3,), in m/s²; ValueError before an estimate with a state."""
        if self._s is None:
            raise ValueError("GradientPolicy knows no state of its model yet")
        B = structure_by_v(self._model, self._s)
        B_dot = structure_along(self._model, self._s, self._s_dot(v, omega))
        return self._rate(v, B, B_dot, (self._k1, self._k2))

    def _s_dot(self, v: FloatArray, omega: FloatArray) -> FloatArray:
        assert self._s is not None
        u = np.concatenate((v, omega))
        return self._model.f_m(self._s, u) + self._model.Omega(self._s, v).T @ self._chi

    def _rate(
        self, v: FloatArray, B: FloatArray, B_dot: FloatArray, gains: tuple[float, float]
    ) -> FloatArray:
        (k1, k2), square = gains, float(v @ v)
        along = k1 * (self._kappa_des - 0.5 * square) / square * v
        if k2 == 0.0:
            return along
        found = spectrum(B @ v)
        _, J_v = least_sigma2(found, B)
        _, rate = least_sigma2(found, (B_dot @ v)[:, :, None])
        push, edge = _push(found, B, math.sqrt(square))
        # J_v† J_s ṡ, faded out where J_v has no direction.
        compensation = min(float(rate[0]), 0.0) / max(float(np.linalg.norm(J_v)), edge) ** 2 * J_v
        ascent = J_v + push - compensation
        across = ascent - (v @ ascent) / square * v
        rates: FloatArray = along + k2 * across
        return rates


def _gain(found: Spectrum, B: FloatArray) -> float:
    """The most that σ1's combination of unknowns shows of itself per unit of speed."""
    return float(np.linalg.norm(np.tensordot(found.U[:, 0], B, 1), 2))


def _push(found: Spectrum, B: FloatArray, speed_m_s: float) -> tuple[FloatArray, float]:
    """What joins J_v (3,) where σ1 all but vanishes, and the ‖J_v‖ below which that is so.

    Fades in, so that v̇ stays continuous.
    """
    # What each velocity makes of the combination of unknowns that belongs to σ1.
    _, gains, directions = np.linalg.svd(np.tensordot(found.U[:, 0], B, 1))
    edge = 2.0 * _ESCAPE_SHARE * speed_m_s * float(gains[0]) ** 2
    faint = edge - 2.0 * float(found.sigma[0] * gains[0])
    if faint <= 0.0:
        return np.zeros(3), edge
    best = directions[0]
    push: FloatArray = faint * np.sign(best[int(np.argmax(np.abs(best)))]) * best
    return push, edge
