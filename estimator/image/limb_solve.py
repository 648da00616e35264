"""The iteration that finds outline, blur, photometry and noise together (compiled)."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.cone import moved, outline_frame
from estimator.image.intrinsics import FloatArray
from estimator.image.limb_edge import ALL_ROWS, BLUR, MOST_PIXELS, PHOTOMETRY
from estimator.image.limb_linear import cholesky, solve_column, solve_fixed
from estimator.image.limb_locate import locate
from estimator.image.limb_noise import learn_ridge, noise_levels
from estimator.image.limb_normal import STATS, accumulate
from estimator.image.limb_pixels import thinned
from estimator.jit import jit

# Prior of the blur parameters (q, M1, h1, M12, M2, h2): sharp to 4 px of motion are likely.
_BLUR_MEAN = np.array([0.2, 0.5, 0.0, 0.0, 0.5, 0.0])
_BLUR_SD = np.array([2.0, 8.0, 1.0, 8.0, 8.0, 1.0])
# Between sharp and 3 px of motion: both are reached from there in few steps.
_BLUR_START = np.array([0.3, 1.5, 0.0, 0.0, 1.5, 0.0])
_BLUR_START_CYLINDER = np.array([0.3, 3.0, 0.0, 0.0, 0.0, 0.0])
# What an image tells about the next one: the blur, the turn of its axes, the two noise levels.
KNOWN = BLUR + 3
_WIDE_Q = 4.0  # widens the model's edge at first, so that a wrong guess is within its reach
_HEAVY_TAIL = 30.0
# Texture is correlated: its variance counts twice. Not along a cylinder's long sectors, where once
# gave the smaller error on textures of 2 to 8 px.
_TEXTURE_WEIGHT_SPHERE, _TEXTURE_WEIGHT_CYLINDER = 2.0, 1.0
# The steps: geometry alone, then blur as well on a part of the pixels, then everything on all. The
# photometry's spread is learnt in the first of these only: the slow rest of it brings nothing.
_GEOMETRY_STEPS, _COARSE_STEPS, _LEARNING_STEPS, _ALL_STEPS = 1, 3, 2, 9
_CONVERGED_RAD = 1e-5
_COARSE_STRIDE, _COARSE_MARGIN_PX, _FINE_MARGIN_PX = 4, 1.2, 0.3
# Inverse prior variances of the photometry. Slopes and limb terms start stiff: they could stand
# in for a blur not yet found. Then they are free, for their true spread to be learnt.
_STIFF = np.array([1e-6, 1e-2, 1.0, 1e-6, 1e-2, 1.0, 1.0])
_FREE = np.array([1e-6, 1 / 400.0, 1 / 16.0, 1e-6, 1 / 400.0, 1 / 16.0, 1 / 400.0])


@jit
def solve_outline(
    pixels: FloatArray, starts: NDArray[np.int64], s: FloatArray, a: FloatArray, geometry: int,
    known: FloatArray,
) -> tuple[
    FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray,
    FloatArray, FloatArray, FloatArray,
]:  # fmt: skip
    """Refine (s, a) on the collected pixels; ``geometry`` is 3 for a sphere, 4 for a cylinder.

    ``known`` (KNOWN,) is what an image just before told of blur and noise, which saves the steps
    that look for them; empty if there is none.

    Returns s, a, blur (BLUR,), photometry (sectors, PHOTOMETRY), the sectors' statistics (sectors,
    STATS), noise (sectors, 2), the covariances of s (3, 3) from the model and from the scatter of
    the sectors' scores, the last step, and what is now known. s is NaN when the equations had no
    solution.
    """
    sectors, n = starts.shape[0] - 1, geometry + BLUR
    information, score = np.zeros((sectors, n, n)), np.zeros((sectors, n))
    back, spread = np.zeros((sectors, PHOTOMETRY, n + 1)), np.zeros((sectors, PHOTOMETRY))
    stats, photometry = np.zeros((sectors, STATS)), np.zeros((sectors, PHOTOMETRY))
    noise = np.empty((sectors, 2))
    noise[:, 0], noise[:, 1] = 9.0, 100.0
    texture_weight = _TEXTURE_WEIGHT_SPHERE if geometry == 3 else _TEXTURE_WEIGHT_CYLINDER
    blur, turn_rad = _first_blur(s, a, geometry)
    ridge = _STIFF.copy()
    if known.shape[0] > 0:
        turn_rad = known[BLUR] if geometry == 3 else turn_rad
        blur, noise[:, 0], noise[:, 1] = known[:BLUR].copy(), known[BLUR + 1], known[BLUR + 2]
    total, step, frame = np.eye(n), np.zeros(n), outline_frame(s, a)
    s_there, a_there, moved_by = s, a, np.zeros(geometry)
    work = np.zeros((3, ALL_ROWS * MOST_PIXELS))
    used, used_starts = thinned(pixels, starts, _COARSE_STRIDE)
    locate(used, s, a, frame)
    index = -2
    while index < _ALL_STEPS - 1:
        index = _COARSE_STEPS if index == -1 and known.shape[0] > 0 else index + 1
        fine = index >= _COARSE_STEPS
        settled = index > _COARSE_STEPS or (fine and known.shape[0] == 0)
        accumulate(
            used, used_starts, moved_by, blur, turn_rad, photometry,
            noise, ridge, 0.0 if index < 0 else _HEAVY_TAIL,
            _FINE_MARGIN_PX if settled else _COARSE_MARGIN_PX, information, score, back, spread,
            stats, work,
        )  # fmt: skip
        if index >= 0:
            total, step = _step(information, score, blur, geometry, index < _GEOMETRY_STEPS)
            moved_by += step[:geometry]
            s, a = moved(s_there, a_there, frame, moved_by)
            blur += step[geometry:]
            turn_rad = _diagonalised(blur, turn_rad, geometry == 3)
            noise_levels(stats, noise, texture_weight)
        # A NaN anywhere arrives here: s then fails the comparison.
        if not s[0] ** 2 + s[1] ** 2 + s[2] ** 2 > 1.0 + 1e-9:
            s = s * np.nan
            break
        _back_substitute(back, step, photometry)
        if index == _GEOMETRY_STEPS - 1:
            blur[:] = _BLUR_START if geometry == 3 else _BLUR_START_CYLINDER
        all_next = index == _COARSE_STEPS - 1 or (index < 0 and known.shape[0] > 0)
        if all_next:
            ridge = _FREE.copy()
            used, used_starts = pixels, starts
        if index == _GEOMETRY_STEPS - 1 or all_next:
            s_there, a_there, frame, moved_by = s, a, outline_frame(s, a), np.zeros(geometry)
            locate(used, s, a, frame)
        if fine and index < _COARSE_STEPS + _LEARNING_STEPS:
            learn_ridge(photometry, spread, stats, ridge, index == _COARSE_STEPS)
        if index >= _COARSE_STEPS + _LEARNING_STEPS - 1 and step_rad(step, s) < _CONVERGED_RAD:
            break
    model, scatter = _covariances(total, information, score, frame, s)
    learnt = np.empty(KNOWN)
    learnt[:BLUR], learnt[BLUR] = blur, turn_rad
    learnt[BLUR + 1], learnt[BLUR + 2] = noise[0, 0], np.mean(noise[:, 1])
    return s, a, blur, photometry, stats, noise, model, scatter, step, learnt


@jit
def step_rad(step: FloatArray, s: FloatArray) -> float:
    """How far a step of the geometry moves the outline, seen from the camera."""
    turn = abs(step[1]) + abs(step[2])
    return float(turn + abs(step[0]) / (s[0] ** 2 + s[1] ** 2 + s[2] ** 2))


@jit
def _first_blur(s: FloatArray, a: FloatArray, geometry: int) -> tuple[FloatArray, float]:
    """The blur to start with, and the turn of its axes: a cylinder's across its lines."""
    blur = _BLUR_MEAN.copy()
    blur[0] = _WIDE_Q
    if geometry == 3:
        return blur, 0.0
    blur[4] = 0.0
    b = outline_frame(s, a)[1]
    return blur, np.arctan2(b[1] * s[2] - b[2] * s[1], b[0] * s[2] - b[2] * s[0])


@jit
def _back_substitute(back: FloatArray, step: FloatArray, photometry: FloatArray) -> None:
    """The photometry that goes with a step of the shared parameters."""
    n = step.shape[0]
    for k in range(photometry.shape[0]):
        for j in range(PHOTOMETRY):
            value = back[k, j, n]
            for i in range(n):
                value -= back[k, j, i] * step[i]
            photometry[k, j] = value


@jit
def _step(
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
        mean, sd = _BLUR_MEAN[i], _BLUR_SD[i]
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
def _diagonalised(blur: FloatArray, turn_rad: float, turning: bool) -> float:
    """Turn the blur's axes so that M12 vanishes; the new angle."""
    blur[0], blur[1], blur[4] = max(blur[0], 0.0), max(blur[1], 0.0), max(blur[4], 0.0)
    if not turning:
        return turn_rad
    by = 0.5 * np.arctan2(2.0 * blur[3], blur[1] - blur[4])
    c, sn = np.cos(by), np.sin(by)
    m1, m12, m2, h1, h2 = blur[1], blur[3], blur[4], blur[2], blur[5]
    blur[1] = max(c * c * m1 + 2.0 * c * sn * m12 + sn * sn * m2, 0.0)
    blur[4] = max(sn * sn * m1 - 2.0 * c * sn * m12 + c * c * m2, 0.0)
    blur[3] = 0.0
    blur[2], blur[5] = c * h1 + sn * h2, c * h2 - sn * h1
    return float(turn_rad + by)


@jit
def _covariances(
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
