"""The model (1) integrated along a measured motion."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from estimator.jit import jit_template
from estimator.models.model import Model

FloatArray = NDArray[np.float64]
Term = Callable[..., FloatArray]  # f_m, Ω or f_u of a model, a template for compilation

# The frozen-Ω step's error goes with its square: about 1e-6 here.
MAX_STEP_S = 4e-3

# Runge and Kutta's fourth-order step errs by 1e-7 over this angle.
_LARGEST_TURN_RAD = 0.1
# No arm turns a camera as fast: such a twist is a fault of what reported it.
_FASTEST_RAD_S = 100.0


def refine(
    times_s: FloatArray, twists: FloatArray, max_step_s: float = MAX_STEP_S
) -> tuple[FloatArray, FloatArray]:
    """Insert nodes into a piecewise-linear twist (n,), (n, 6) until no step is longer."""
    pieces = np.ceil((times_s[1:] - times_s[:-1]) / max_step_s)
    if pieces.max(initial=0.0) <= 1.0:
        return times_s, twists
    counts = pieces.astype(int)
    before = np.repeat(np.arange(counts.size), counts)  # the old node at or before each new one
    within = np.arange(before.size) - np.repeat(np.cumsum(counts) - counts, counts)
    share = within / counts[before]
    steps_s, changes = np.diff(times_s), np.diff(twists, axis=0)
    fine_s = times_s[before] + share * steps_s[before]
    fine = twists[before] + share[:, None] * changes[before]
    return np.append(fine_s, times_s[-1]), np.concatenate((fine, twists[-1:]))


def integrate(
    model: Model, s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """s (b, n, m) and χ (b, n, p) at ``times_s`` (n,) from b starts s0 (b, m), χ0 (b, p).

    Raises ArithmeticError where the twist is faster than can be followed.
    """
    s, chi = model.flow(s0, chi0, times_s, twists)
    if not np.isfinite(s[:, -1]).all():
        raise ArithmeticError(
            f"the model cannot be followed over {times_s[-1] - times_s[0]:.3f} s of motion: "
            "the measured twist is implausibly fast"
        )
    return s, chi


@jit_template
def follow(
    f_m: Term,
    Omega: Term,
    f_u: Term,
    s0: FloatArray,
    chi0: FloatArray,
    times_s: FloatArray,
    twists: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """``Model.flow`` of the model with these three terms: Runge and Kutta's step at each node."""
    (b, m), p, n = s0.shape, chi0.shape[1], times_s.size
    states = np.full((b, n, m + p), np.nan)
    states[:, 0, :m], states[:, 0, m:] = s0, chi0
    scratch = np.empty((5, m + p))
    for i in range(b):
        for k in range(n - 1):
            h = times_s[k + 1] - times_s[k]
            fastest = max(_norm(twists[k, 3:]), _norm(twists[k + 1, 3:]))
            if not fastest <= _FASTEST_RAD_S:
                break  # the rest stays NaN
            pieces = 1 + int(h * fastest / _LARGEST_TURN_RAD)
            states[i, k + 1] = states[i, k]
            for piece in range(pieces):
                span = (piece / pieces, 1.0 / pieces)
                _step(f_m, Omega, f_u, states[i, k + 1], m, twists[k : k + 2], h, span, scratch)
    return states[:, :, :m].copy(), states[:, :, m:].copy()


@jit_template
def _step(
    f_m: Term,
    Omega: Term,
    f_u: Term,
    state: FloatArray,
    m: int,
    ends: FloatArray,
    duration_s: float,
    span: tuple[float, float],
    scratch: FloatArray,
) -> None:
    """Move ``state`` (m + p,) over the share ``span`` (first, length) of a linear piece.

    ``ends`` (2, 6) are the twists at its ends, ``duration_s`` is all of its length.
    """
    u, x, h = np.empty(6), scratch[4], span[1] * duration_s
    for stage in range(4):
        reach = 0.5 * ((stage + 1) // 2)  # 0, 1/2, 1/2, 1 of the step
        share = span[0] + reach * span[1]
        for j in range(6):
            u[j] = ends[0, j] + share * (ends[1, j] - ends[0, j])
        for j in range(state.size):
            x[j] = state[j] + (reach * h * scratch[stage - 1, j] if stage > 0 else 0.0)
        _rates(f_m, Omega, f_u, x[:m], x[m:], u, scratch[stage])
    for j in range(state.size):
        total = scratch[0, j] + 2.0 * (scratch[1, j] + scratch[2, j]) + scratch[3, j]
        state[j] += h * total / 6.0


@jit_template
def structures(Omega: Term, s: FloatArray, twists: FloatArray) -> FloatArray:
    """``Model.structures`` of the model with this Ω."""
    first = Omega(s[0], twists[0, :3])
    rows = np.empty((s.shape[0], first.shape[0], first.shape[1]))
    for k in range(s.shape[0]):
        rows[k] = Omega(s[k], twists[k, :3])
    return rows


@jit_template
def _rates(
    f_m: Term,
    Omega: Term,
    f_u: Term,
    s: FloatArray,
    chi: FloatArray,
    u: FloatArray,
    out: FloatArray,
) -> None:
    """(ṡ, χ̇) of (1) into ``out`` (m + p,)."""
    s_dot, rows, chi_dot = f_m(s, u), Omega(s, u[:3]), f_u(s, chi, u)
    m = s.size
    for j in range(m):
        out[j] = s_dot[j]
        for i in range(chi.size):
            out[j] += rows[i, j] * chi[i]
    for i in range(chi.size):
        out[m + i] = chi_dot[i]


@jit_template
def _norm(v: FloatArray) -> float:
    return math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
