"""The damping of the estimation error: c_i, and the gain H that puts it into (2)."""

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Ω's share below which the camera counts as standing, in Ω's unit (m/s for sphere, cylinder):
# several times the noise of a real arm's measured velocity.
REST_SIGMA = 1e-3

# A camera that only reverses passes through zero in less than this.
_REST_AFTER_S = 0.05

# How fast w = Ω ξ is then forgotten.
_REST_RATE_PER_S = 1e3


def damping_rates(sigma: FloatArray, alpha: float, damping: float) -> FloatArray:
    """c_i = damping · c_i*, with c_i* = 2 √α σ_i the critical one; ``sigma`` of any shape."""
    return (2.0 * damping * math.sqrt(alpha)) * sigma


def rest_rates(
    sigma: FloatArray, steps_s: FloatArray, rested_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What is added to c_i (n, p) in each of n steps so that a camera at rest leaves χ̂ alone.

    (5) taken literally coasts: once σ = 0 it reads z̈ = 0 and χ̂ drifts at whatever rate it had,
    though nothing is measured any more. (2) itself says χ̂ stands still when Ω = 0; forgetting
    w makes it so. ``sigma`` (n, p) per step of ``steps_s`` (n,); ``rested_s`` (p,) is how long
    each σ_i has been below the threshold before. Also returns how long it has been (p,) after.
    """
    below = sigma < REST_SIGMA
    elapsed = np.cumsum(np.where(below, steps_s[:, None], 0.0), axis=0)
    since = np.maximum.accumulate(np.where(below, -rested_s, elapsed), axis=0)
    resting_s = elapsed - since
    depth = np.where(resting_s > _REST_AFTER_S, 1.0 - sigma / REST_SIGMA, 0.0)
    return _REST_RATE_PER_S * depth * depth, resting_s[-1]


def H(Omega: FloatArray, Omega_dot: FloatArray, alpha: float, damping: float) -> FloatArray:
    """The gain H (m, m) of (2) that makes the error obey (5) exactly for any Ω(t) (p, m), σ > 0.

    H = Ω⁺ (C Ω + Ω̇) + c2 (I − Ω⁺ Ω), with C = U diag(c_i) Uᵀ and Ω Ωᵀ = U diag(σ_i²) Uᵀ, for
    then ẇ = −C w + Ω Ωᵀ z and ż = −α w, where w = Ω ξ. With p = 1 it is errata.md's
    c1 u uᵀ + c2 (I − u uᵀ) + u u̇ᵀ + (σ̇/σ) u uᵀ. c2 is the largest c_i; what it damps never
    reaches χ̂. Raises ValueError when Ω has not full rank.
    """
    squares, U = np.linalg.eigh(Omega @ Omega.T)
    if not squares[0] > 0.0:
        raise ValueError("H is defined only while every σ_i is positive")
    c = damping_rates(np.sqrt(squares), alpha, damping)
    C = (U * c) @ U.T
    inverse = np.linalg.pinv(Omega)
    rest = np.eye(Omega.shape[1]) - inverse @ Omega
    gain: FloatArray = inverse @ (C @ Omega + Omega_dot) + c.max() * rest
    return gain
