"""The ideal response (5), and how far a real one is from it."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimator.gain import damping_rates
from estimator.second_order import exact_step

FloatArray = NDArray[np.float64]

# Frozen coefficients per step: the step's error goes with the square of √α σ h.
_MAX_PHASE = 0.02
_MAX_STEP_S = 5e-3


def ideal_response(
    t_s: ArrayLike,
    sigma2: ArrayLike,
    alpha: float,
    damping: float,
    z0: float,
    at_s: ArrayLike,
) -> FloatArray:
    """z (k,) at the instants ``at_s`` (k,) of z̈ + c1 ż + α σ² z = 0, c1 = damping · 2 √α σ, (5).

    σ² (n,) is linear between the instants ``t_s`` (n,); z = z0 and ż = 0 at the first of them.
    Raises ValueError when ``at_s`` leaves [t_s[0], t_s[-1]], when ``t_s`` does not increase, or
    when σ² is negative.
    """
    times, squares = np.asarray(t_s, dtype=float), np.asarray(sigma2, dtype=float)
    at = np.asarray(at_s, dtype=float)
    _check(times, squares, at)
    nodes = _nodes(times, squares, alpha, at)
    steps_s = np.diff(nodes)
    middle = np.interp(nodes[:-1] + 0.5 * steps_s, times, squares)
    c = damping_rates(np.sqrt(middle), alpha, damping)
    step = exact_step(alpha, middle, c, steps_s)
    z, w = float(z0), 0.0
    response = np.empty(nodes.size)
    response[0] = z
    rows = zip(*(entry.tolist() for entry in step), strict=True)
    for index, (zz, zw, wz, ww) in enumerate(rows):
        z, w = zz * z + zw * w, wz * z + ww * w
        response[index + 1] = z
    return response[np.searchsorted(nodes, at)]


def rms_vs_ideal(t_s: ArrayLike, z: ArrayLike, z_ideal: ArrayLike) -> float:
    """The rms over time of z − z_ideal, as a share of |z| at the first instant.

    All (n,), n >= 2; time-weighted (trapezoidal), so dropped frames do not count as agreement.
    Raises ValueError when z starts at zero.
    """
    times, error = np.asarray(t_s, dtype=float), np.asarray(z, dtype=float)
    start = abs(float(error[0]))
    if not start > 0.0:
        raise ValueError("the response starts at zero error: there is nothing to relate it to")
    squares = (error - np.asarray(z_ideal, dtype=float)) ** 2
    mean = float(np.trapezoid(squares, times)) / float(times[-1] - times[0])
    return math.sqrt(mean) / start


def time_to_within(t_s: ArrayLike, relative_error: ArrayLike, bound: float) -> float | None:
    """The time from t_s[0] to the first instant after which |relative_error| stays <= bound.

    Both (n,); a value that is not a number counts as outside. None if it is never so.
    """
    times, error = np.asarray(t_s, dtype=float), np.asarray(relative_error, dtype=float)
    outside = np.flatnonzero(~(np.abs(error) <= bound))
    first = int(outside[-1]) + 1 if outside.size else 0
    return None if first >= times.size else float(times[first] - times[0])


def _check(times: FloatArray, squares: FloatArray, at: FloatArray) -> None:
    if times.ndim != 1 or times.shape != squares.shape or times.size < 2:
        raise ValueError("t_s and sigma2 must be of one length, two or more")
    if np.any(np.diff(times) <= 0.0):
        raise ValueError("t_s must increase")
    if not np.all(squares >= 0.0):
        raise ValueError("sigma2 must not be negative")
    if at.size and not (times[0] <= at.min() and at.max() <= times[-1]):
        raise ValueError(
            f"sigma2 is known from {times[0]:.6f} to {times[-1]:.6f} s, "
            f"the response is asked for from {at.min():.6f} to {at.max():.6f} s"
        )


def _nodes(times: FloatArray, squares: FloatArray, alpha: float, at: FloatArray) -> FloatArray:
    """The given instants with steps short enough between, the asked ones among them."""
    largest = math.sqrt(alpha * float(squares.max()))
    longest_s = min(_MAX_STEP_S, _MAX_PHASE / largest if largest > 0.0 else _MAX_STEP_S)
    known = np.union1d(times, at)
    pieces = np.maximum(np.ceil(np.diff(known) / longest_s).astype(int), 1)
    inner = [
        np.linspace(start, end, count, endpoint=False)
        for start, end, count in zip(known[:-1], known[1:], pieces, strict=True)
    ]
    return np.concatenate([*inner, known[-1:]])
