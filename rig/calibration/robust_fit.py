"""Levenberg–Marquardt with Huber's loss, for many residuals and a few unknowns.

By the normal equations, scaled to unit diagonal. The general solvers decompose the whole
derivative by singular values in as many threads as there are processors, which for 1500 x 21
takes ten times as long, and far longer on a busy machine.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
State = TypeVar("State")

ROBUST_FROM = 3.0  # standard deviations from which a residual counts linearly
_STEPS = 40
_CONVERGED = 1e-6  # expected gain left, in units of the cost (a standard deviation is 0.5)
_MOST_DAMPING = 1e8


def robust_fit(
    start: State,
    evaluate: Callable[[State], tuple[FloatArray, FloatArray]],
    move: Callable[[State, FloatArray], State],
) -> State:
    """The state of least Huber loss near ``start``.

    ``evaluate`` gives residuals (n,) in standard deviations, measured minus predicted, and the
    derivatives (n, p) of the prediction by a step; ``move`` applies a step (p,).
    """
    state, damping = start, 1e-3
    r, J = evaluate(state)
    cost = _cost(r)
    for _ in range(_STEPS):
        normal, right = normal_equations(r, J)
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        scaled = normal / np.outer(scale, scale) + damping * np.eye(len(scale))
        step = np.linalg.solve(scaled, right / scale) / scale
        if float(right @ step) < _CONVERGED:
            break
        tried = move(state, step)
        r_tried, J_tried = evaluate(tried)
        cost_tried = _cost(r_tried)
        if cost_tried <= cost:
            state, r, J, cost = tried, r_tried, J_tried, cost_tried
            damping = max(damping / 10.0, 1e-12)
        else:
            damping *= 10.0
            if damping > _MOST_DAMPING:
                break
    return state


def weights(r: FloatArray) -> FloatArray:
    """By how much Huber's loss weighs residuals down: 1 up to ``ROBUST_FROM``."""
    return ROBUST_FROM / np.maximum(np.abs(r), ROBUST_FROM)


def normal_equations(r: FloatArray, J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The weighted normal matrix (p, p) and right side (p,)."""
    weighted = J * weights(r)[:, None]
    # einsum, unlike a matrix product, starts no threads.
    return np.einsum("ni,nj->ij", weighted, J), np.einsum("ni,n->i", weighted, r)


def _cost(r: FloatArray) -> float:
    size = np.abs(r)
    linear = ROBUST_FROM * (size - 0.5 * ROBUST_FROM)
    cost = float(np.sum(np.where(size <= ROBUST_FROM, 0.5 * r**2, linear)))
    return cost if np.isfinite(cost) else float("inf")
