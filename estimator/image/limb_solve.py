"""The iteration that finds outline, blur, photometry and noise together (compiled)."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.cone import moved, outline_frame
from estimator.image.intrinsics import FloatArray
from estimator.image.limb_normal import (
    BLUR,
    N_IN,
    N_OUT,
    PHOTOMETRY,
    SS_IN,
    SS_OUT,
    STATS,
    accumulate,
    cholesky,
    solve_column,
)
from estimator.image.limb_pixels import refresh_distances
from estimator.jit import jit

# Prior of the blur parameters (q, M1, h1, M12, M2, h2): sharp to 4 px of motion are likely.
_BLUR_MEAN = np.array([0.2, 0.5, 0.0, 0.0, 0.5, 0.0])
_BLUR_SD = np.array([2.0, 8.0, 1.0, 8.0, 8.0, 1.0])
_WIDE_Q = 4.0  # widens the model's edge at first, so that a wrong guess is within its reach
_HEAVY_TAIL = 30.0
_BACKGROUND_WEIGHT = 2.0  # texture is correlated: its variance counts this many times
_LEAST_READ_VARIANCE = 0.1  # rounding to whole grey levels is 1/12
_COARSE_STEPS = 5
_COARSE_STRIDE = 3


@jit
def solve_outline(
    pixels: FloatArray, starts: NDArray[np.int64], s: FloatArray, a: FloatArray, geometry: int,
    fine_steps: int,
) -> tuple[
    FloatArray, FloatArray, FloatArray, float, FloatArray, FloatArray, FloatArray, FloatArray,
    FloatArray, float,
]:  # fmt: skip
    """Refine (s, a) on the collected pixels.

    Returns s, a, blur (BLUR,), its frame's turn in rad, photometry (sectors, PHOTOMETRY), the
    sectors' statistics (sectors, STATS), noise (sectors, 2), the covariances of s (3, 3) from the
    model and from the scatter of the sectors' scores, and the last step in px. s is NaN when the
    equations became singular.
    """
    sectors = starts.shape[0] - 1
    n = geometry + BLUR
    information = np.zeros((sectors, n, n))
    score = np.zeros((sectors, n))
    back = np.zeros((sectors, PHOTOMETRY, n + 1))
    spread = np.zeros((sectors, PHOTOMETRY))
    stats = np.zeros((sectors, STATS))
    photometry = np.zeros((sectors, PHOTOMETRY))
    noise = np.empty((sectors, 2))
    noise[:, 0], noise[:, 1] = 9.0, 100.0
    # Slopes and limb terms start stiff: they could stand in for a blur not yet found.
    ridge = np.array([1e-6, 1e-2, 1.0, 1e-6, 1e-2, 1.0, 1.0])
    blur = _BLUR_MEAN.copy()
    blur[0] = _WIDE_Q
    turn_rad = 0.0
    if geometry == 4:
        blur[4] = 0.0
        normal = outline_frame(s, a)[1]
        turn_rad = np.arctan2(
            normal[1] * s[2] - normal[2] * s[1], normal[0] * s[2] - normal[2] * s[0]
        )
    coarse_stride = 4
    total = np.zeros((n, n))
    step_px = 1e9
    frame = outline_frame(s, a)
    for step_index in range(-1, _COARSE_STEPS + fine_steps):
        coarse = step_index < _COARSE_STEPS - 1 or fine_steps == 0
        frame = outline_frame(s, a)
        accumulate(
            pixels, starts, coarse_stride if coarse else 1, s, a, frame, blur, turn_rad,
            photometry, noise, ridge, 0.0 if step_index < 0 else _HEAVY_TAIL, geometry,
            1.2 if coarse else 0.3,
            information, score, back, spread, stats,
        )  # fmt: skip
        if step_index < 0:
            photometry[:] = back[:, :, n]
            continue
        total, step = _step(information, score, blur, geometry, step_index < 2)
        if not np.all(np.isfinite(step)):
            return (
                s * np.nan, a, blur, turn_rad, photometry, stats, noise, total[:3, :3],
                total[:3, :3], step_px,
            )  # fmt: skip
        length = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
        step_px = 800.0 * (abs(step[0]) / length**2 + abs(step[1]) + abs(step[2]))
        s, a = moved(s, a, frame, step[:geometry])
        if not s[0] ** 2 + s[1] ** 2 + s[2] ** 2 > 1.0 + 1e-9:
            s = s * np.nan
            break
        for k in range(sectors):
            for j in range(PHOTOMETRY):
                value = back[k, j, n]
                for i in range(n):
                    value -= back[k, j, i] * step[i]
                photometry[k, j] = value
        for i in range(BLUR):
            blur[i] += step[geometry + i]
        if step_index == 1:
            blur[0] = _BLUR_MEAN[0]
        turn_rad = _diagonalised(blur, turn_rad, geometry == 3)
        _noise_levels(stats, noise, 2.0 if geometry == 3 else 1.0)
        if step_index == 3:
            ridge[1] = ridge[4] = 1.0 / 20.0**2
            ridge[2] = ridge[5] = 1.0 / 4.0**2
            ridge[6] = 1.0 / 20.0**2
        if step_index >= 4:
            _shrink(photometry, spread, stats, ridge, step_index == 4)
        if step_index == 1 or step_index == _COARSE_STEPS - 2:
            refresh_distances(pixels, s, a)
    model, scatter = _covariances(total, information, score, frame, s, geometry)
    return s, a, blur, turn_rad, photometry, stats, noise, model, scatter, step_px


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
    fixed = np.zeros(n, dtype=np.bool_)
    value = np.zeros(n)
    if no_blur:
        fixed[geometry:] = True
    step = _solve_fixed(total, rhs, fixed, value)
    for _ in range(3):
        worst, at = -1e-9, -1
        for i in range(n - geometry):
            bounded = i == 0 or i == 1 or i == 4
            low = blur[i] + step[geometry + i]
            if bounded and not fixed[geometry + i] and low < worst:
                worst, at = low, i
        if at < 0:
            break
        fixed[geometry + at] = True
        value[geometry + at] = -blur[at]
        step = _solve_fixed(total, rhs, fixed, value)
    return total, step


@jit
def _solve_fixed(
    matrix: FloatArray, rhs: FloatArray, fixed: NDArray[np.bool_], value: FloatArray
) -> FloatArray:
    """Solution of matrix x = rhs over the free entries, the others held at ``value``."""
    n = rhs.shape[0]
    m = matrix.copy()
    x = np.zeros((n, 1))
    for i in range(n):
        x[i, 0] = rhs[i]
    for f in range(n):
        if not fixed[f]:
            continue
        for i in range(n):
            x[i, 0] -= matrix[i, f] * value[f]
            m[i, f] = m[f, i] = 0.0
        m[f, f] = 1.0
    for f in range(n):
        if fixed[f]:
            x[f, 0] = value[f]
    cholesky(m)
    solve_column(m, x, 0)
    return x[:, 0].copy()


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
    return turn_rad + by


@jit
def _noise_levels(stats: FloatArray, noise: FloatArray, texture_weight: float) -> None:
    """Reading variance from the inside, background variance per sector from the outside."""
    sectors = stats.shape[0]
    inner = np.empty(sectors)
    count = 0
    n_in = ss_in = n_out = ss_out = 0.0
    for k in range(sectors):
        free_in, free_out = stats[k, N_IN] - 4.0, stats[k, N_OUT] - 3.0
        if free_in > 3.0:
            inner[count] = stats[k, SS_IN] / free_in
            count += 1
            n_in += free_in
            ss_in += stats[k, SS_IN]
        if free_out > 3.0:
            n_out += free_out
            ss_out += stats[k, SS_OUT]
    read = ss_in / max(n_in, 1.0)
    if count > 0:
        read = min(read, 1.05 * float(np.median(inner[:count])))
    read = max(read, _LEAST_READ_VARIANCE)
    outer = ss_out / max(n_out, 1.0)
    for k in range(sectors):
        free_out = max(stats[k, N_OUT] - 3.0, 0.0)
        local = (stats[k, SS_OUT] + 15.0 * outer) / (free_out + 15.0)
        noise[k, 0] = read
        noise[k, 1] = texture_weight * max(local - read, 0.0)


@jit
def _shrink(
    photometry: FloatArray, spread: FloatArray, stats: FloatArray, ridge: FloatArray, first: bool
) -> None:
    """Learn from all sectors how large slopes and limb terms are here (empirical Bayes).

    ``first``: p was found almost without a prior, so that its own scatter is subtracted, and four
    standard deviations of what that leaves uncertain are added; later the usual expectation step.
    """
    square = np.zeros(PHOTOMETRY)
    scatter = np.zeros(PHOTOMETRY)
    count = 0
    for k in range(photometry.shape[0]):
        if stats[k, N_IN] + stats[k, N_OUT] < 6.0:
            continue
        count += 1
        for j in range(PHOTOMETRY):
            square[j] += photometry[k, j] ** 2
            scatter[j] += spread[k, j]
    if count == 0:
        return
    for j in (1, 2, 4, 5, 6):
        second = (square[j] + scatter[j]) / count
        if first:
            second = max(square[j] - scatter[j], 0.0) / count
            second += 4.0 * scatter[j] / count * np.sqrt(2.0 / count)
        ridge[j] = 1.0 / max(second, 1e-4)


@jit
def _covariances(
    total: FloatArray, information: FloatArray, score: FloatArray, frame: FloatArray,
    s: FloatArray, geometry: int,
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
