"""σ_i², how fast each combination of unknowns can be estimated, for any model: equation (6).

Ω is linear in v, so all its values at a state are ``B @ v`` with B (p, m, 3) of
``structure_by_v``; everything here is made of B and its derivatives.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.models.model import Model

FloatArray = NDArray[np.float64]

# Eigenvalues nearer to each other than this share of the largest count as equal.
_EQUAL = 1e-9
# The power of the mean that stands for the least eigenvalue where a gradient is wanted.
_SHARPNESS = 16
# Of the differences in s, as a share: exact for an Ω of up to fourth degree in s.
_STEP = 1e-3


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Ω = U diag(σ) Vᵀ, σ1 being the least."""

    sigma: FloatArray  # (p,) ascending
    U: FloatArray  # (p, p) a column for each σ_i
    V: FloatArray  # (m, p)

    @property
    def sigma2(self) -> FloatArray:
        """The eigenvalues (p,) of Ω Ωᵀ, ascending."""
        return self.sigma**2


def spectrum(Omega: FloatArray) -> Spectrum:
    """The σ_i of Ω (p, m) and what goes with them; ValueError for m < p, see after (3)."""
    p, m = Omega.shape
    if m < p:
        raise ValueError(f"{m} measured quantities cannot tell {p} unknowns: m >= p is needed")
    U, sigma, Vt = np.linalg.svd(Omega, full_matrices=False)
    return Spectrum(sigma[::-1].copy(), U[:, ::-1].copy(), Vt[::-1].T.copy())


def structure_by_v(model: Model, s: FloatArray) -> FloatArray:
    """∂Ω/∂v (p, m, 3) at s (m,)."""
    return np.stack([model.Omega(s, axis) for axis in np.eye(3)], axis=-1)


def structure_along(model: Model, s: FloatArray, s_dot: FloatArray) -> FloatArray:
    """d/dt ∂Ω/∂v (p, m, 3) while s (m,) changes at the rate ``s_dot`` (m,)."""
    norm = float(np.linalg.norm(s_dot))
    if norm == 0.0:
        return np.zeros((model.p, model.m, 3))
    h = _STEP * max(1.0, float(np.abs(s).max()))
    step = h / norm * s_dot
    near = structure_by_v(model, s + step) - structure_by_v(model, s - step)
    far = structure_by_v(model, s + 2.0 * step) - structure_by_v(model, s - 2.0 * step)
    return (8.0 * near - far) * (norm / (12.0 * h))


def structure_by_s(model: Model, s: FloatArray, v: FloatArray) -> FloatArray:
    """∂Ω/∂s (p, m, m) at s (m,) and v (3,)."""
    columns = [structure_along(model, s, axis) @ v for axis in np.eye(s.size)]
    return np.stack(columns, axis=-1)


def sigma2_jacobian(found: Spectrum, Omega_x: FloatArray) -> FloatArray:
    """∂σ_i²/∂x = 2 σ_i u_iᵀ (∂Ω/∂x) v_i (p, k), the J of (6), for ∂Ω/∂x (p, m, k).

    Eigenvalues that are equal have no derivatives of their own, as their eigenvectors are any
    basis; each of them is given the mean of theirs, which no basis changes.
    """
    each = _each(found, Omega_x)
    sigma2 = found.sigma2
    apart = np.diff(sigma2) > _EQUAL * sigma2[-1]
    group = np.concatenate(([0], np.cumsum(apart)))
    mean: FloatArray = np.array([each[group == g].mean(axis=0) for g in group])
    return mean


def least_sigma2(found: Spectrum, Omega_x: FloatArray) -> tuple[float, FloatArray]:
    """σ1² made smooth, for climbing, and its gradient (k,) for ∂Ω/∂x (p, m, k).

    The least of several eigenvalues has a kink wherever two are equal, and that is where its
    maximum tends to be. This is their mean of power −16 instead, at most p^(1/16) times the least;
    it has a gradient everywhere, and for p = 1 it is σ1² itself.
    """
    sigma2 = found.sigma2
    # σ1²/σ_i², also where a σ_i² is zero: those are as small as the least.
    ratio = np.where(sigma2 > 0.0, sigma2[0] / np.where(sigma2 > 0.0, sigma2, 1.0), 1.0)
    mean = float((ratio**_SHARPNESS).mean())
    weights = ratio ** (_SHARPNESS + 1) * mean ** (-1.0 - 1.0 / _SHARPNESS) / ratio.size
    gradient: FloatArray = weights @ _each(found, Omega_x)
    return float(sigma2[0]) * mean ** (-1.0 / _SHARPNESS), gradient


def _each(found: Spectrum, Omega_x: FloatArray) -> FloatArray:
    """2 σ_i u_iᵀ (∂Ω/∂x) v_i (p, k)."""
    rates: FloatArray = np.einsum("pi,pmk,mi->ik", found.U, Omega_x, found.V)
    return 2.0 * found.sigma[:, None] * rates
