"""The model (1) integrated along a measured motion."""

import numpy as np
from numpy.typing import NDArray

from estimator.models.model import Model

FloatArray = NDArray[np.float64]

# The trapezoid's and the frozen-Ω step's errors go with its square: about 1e-6 here.
MAX_STEP_S = 4e-3

# Picard's iteration gains a factor ‖ω‖ T / k in its k-th step: short chunks need few steps.
_CHUNK_NODES = 64
_MAX_STEPS = 40
_TOLERANCE = 1e-9


def refine(
    times_s: FloatArray, twists: FloatArray, max_step_s: float = MAX_STEP_S
) -> tuple[FloatArray, FloatArray]:
    """Insert nodes into a piecewise-linear twist (n,), (n, 6) until no step is longer."""
    pieces = np.ceil(np.diff(times_s) / max_step_s).astype(int)
    if np.all(pieces <= 1):
        return times_s, twists
    index = np.arange(times_s.size)
    # Position of every node in units of old intervals: 0, 1/k, 2/k, ...
    starts = np.repeat(index[:-1], pieces)
    within = np.arange(starts.size) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    position = np.append(starts + within / np.repeat(pieces, pieces), float(index[-1]))
    columns = [np.interp(position, index, column) for column in twists.T]
    return np.interp(position, index, times_s), np.stack(columns, axis=-1)


def integrate(
    model: Model, s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """s (b, n, m) and χ (b, n, p) at ``times_s`` (n,) from b starts s0 (b, m), χ0 (b, p).

    Trapezoidal rule on the nodes, solved by Picard's iteration over all of them at once.
    """
    m = s0.shape[-1]
    start = np.concatenate((s0, chi0), axis=-1)
    states = np.repeat(start[:, None, :], times_s.size, axis=1)
    for first in range(0, times_s.size - 1, _CHUNK_NODES):
        nodes = slice(first, first + _CHUNK_NODES + 1)
        chunk = _picard(model, states[:, first, :], m, times_s[nodes], twists[nodes])
        states[:, nodes] = chunk
    return states[..., :m], states[..., m:]


def _picard(
    model: Model, start: FloatArray, m: int, times_s: FloatArray, twists: FloatArray
) -> FloatArray:
    half_steps = (0.5 * np.diff(times_s))[:, None]
    states = np.repeat(start[:, None, :], times_s.size, axis=1)
    scale = _TOLERANCE * float(np.abs(start).max())
    for _ in range(_MAX_STEPS):
        rates = _rates(model, states[..., :m], states[..., m:], twists)
        moved = np.cumsum(half_steps * (rates[:, 1:] + rates[:, :-1]), axis=1) + start[:, None, :]
        change = float(np.abs(moved - states[:, 1:]).max())
        states[:, 1:] = moved
        if change <= scale:
            return states
    raise ArithmeticError(
        f"the model did not settle over {times_s[-1] - times_s[0]:.3f} s of motion: "
        "the measured twist is implausibly fast"
    )


def _rates(model: Model, s: FloatArray, chi: FloatArray, twists: FloatArray) -> FloatArray:
    structure = (chi[..., None, :] @ model.Omega(s, twists[:, :3]))[..., 0, :]  # Ωᵀ χ
    s_dot = model.f_m(s, twists) + structure
    return np.concatenate((s_dot, model.f_u(s, chi, twists)), axis=-1)
