"""From the sectors' reduced equations to the next step, and to the covariances (compiled)."""

import numpy as np

from estimator.image.intrinsics import FloatArray
from estimator.image.limb_blur import BLUR_MEAN, BLUR_SD
from estimator.image.limb_edge import BLUR, PHOTOMETRY
from estimator.image.limb_linear import cholesky, solve_column, solve_fixed
from estimator.jit import jit

_SHORTEST = 3.0  # steps that go to and fro are shortened up to so many times


@jit
def step_rad(step: FloatArray, s: FloatArray) -> float:
    """How far a step of the geometry moves the outline, seen from the camera."""
    turn = abs(step[1]) + abs(step[2])
    return float(turn + abs(step[0]) / (s[0] ** 2 + s[1] ** 2 + s[2] ** 2))


@jit
def step_in_deviations(total: FloatArray, step: FloatArray, geometry: int) -> float:
    """The geometry's part of a step over its standard deviation, were the blur known."""
    square = 0.0
    for i in range(geometry):
        for j in range(geometry):
            square += step[i] * total[i, j] * step[j]
    return float(np.sqrt(max(square, 0.0)))


@jit
def shorten(total: FloatArray, before: FloatArray, step: FloatArray, shortened: float) -> float:
    """Divide ``step`` by what the step ``before``, divided by ``shortened``, was too long.

    Steps that only go to and fro then end in the middle. Returns what it was divided by.
    """
    back = square = 0.0
    for i in range(step.shape[0]):
        for j in range(step.shape[0]):
            back -= step[i] * total[i, j] * before[j]
            square += before[i] * total[i, j] * before[j]
    if square > 0.0:
        shortened = min(max(shortened + back / square, 1.0), _SHORTEST)
        step /= shortened
    return shortened


@jit
def back_substitute(back: FloatArray, step: FloatArray, photometry: FloatArray) -> None:
    """The photometry that goes with a step of the shared parameters."""
    n = step.shape[0]
    for k in range(photometry.shape[0]):
        for j in range(PHOTOMETRY):
            value = back[k, j, n]
            for i in range(n):
                value -= back[k, j, i] * step[i]
            photometry[k, j] = value


@jit
def next_step(
    information: FloatArray, score: FloatArray, blur: FloatArray, geometry: int, no_blur: bool
) -> tuple[FloatArray, FloatArray]:
    """Total information with the prior, and the step that keeps the widths non-negative."""
    n = score.shape[1]
    total = np.zeros((n, n))
    rhs = np.zeros(n)
    for k in range(score.shape[0]):
        for i in range(n):
            rhs[i] += score[k, i]
            for j in range(n):
                total[i, j] += information[k, i, j]
    motion2 = max(blur[1] + blur[4], 0.0)
    for i in range(BLUR):
        mean, sd = BLUR_MEAN[i], BLUR_SD[i]
        if i == 2 or i == 5:
            sd = 0.02 + 0.4 * np.sqrt(motion2)
        elif geometry == 4 and i > 2:
            mean, sd = 0.0, 0.02 + 0.3 * motion2
        total[geometry + i, geometry + i] += 1.0 / sd**2
        rhs[geometry + i] -= (blur[i] - mean) / sd**2
    return total, _kept_positive(total, rhs, blur, geometry, no_blur)


@jit
def _kept_positive(
    total: FloatArray, rhs: FloatArray, blur: FloatArray, geometry: int, no_blur: bool
) -> FloatArray:
    """Solution of total step = rhs that leaves q, M1 and M2 non-negative (active set)."""
    n = rhs.shape[0]
    fixed = np.zeros(n, dtype=np.bool_)
    value = np.zeros(n)
    if no_blur:
        fixed[geometry:] = True
    step = solve_fixed(total, rhs, fixed, value)
    for _ in range(3):
        worst, at = -1e-9, -1
        for i in (0, 1, 4):
            low = blur[i] + step[geometry + i]
            if not fixed[geometry + i] and low < worst:
                worst, at = low, i
        if at < 0:
            break
        fixed[geometry + at] = True
        value[geometry + at] = -blur[at]
        step = solve_fixed(total, rhs, fixed, value)
    return step


@jit
def covariances(
    total: FloatArray, information: FloatArray, score: FloatArray, frame: FloatArray,
    s: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Covariance of s from the model's information, and from the scatter of the scores."""
    n = total.shape[0]
    inverse = np.zeros((n, n))
    factor = total.copy()
    cholesky(factor)
    for i in range(n):
        inverse[i, i] = 1.0
        solve_column(factor, inverse, i)
    meat = np.zeros((n, n))
    for k in range(score.shape[0]):
        for i in range(n):
            for j in range(n):
                meat[i, j] += score[k, i] * score[k, j]
                total[i, j] -= information[k, i, j]
    # What is left of total is the prior's information, itself a (perfect) measurement.
    scatter = inverse @ (meat + total) @ inverse
    length = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
    to_s = np.empty((3, 3))
    to_s[:, 0], to_s[:, 1], to_s[:, 2] = frame[2], -length * frame[1], length * frame[0]
    g = to_s.T.copy()
    return to_s @ inverse[:3, :3].copy() @ g, to_s @ scatter[:3, :3].copy() @ g
