"""The light from afar that explains a cylinder's grey by the angle of its surface (compiled)."""

import numpy as np

from estimator.image.intrinsics import FloatArray
from estimator.image.limb_linear import cholesky, solve_column
from estimator.jit import jit

BINS = 32  # of the angle, over half a turn
# Of a bin: how many samples, their mean angle and grey; then the angle's cosine and sine.
COUNT, ANGLE, GREY, COS, SIN, COLUMNS = range(6)
_LEAST_SAMPLES, _LEAST_BINS = 200, 8
_DIRECTIONS, _LIGHT_STEPS = 48, 5
# What a body's grey may differ (rms) from light on a plain surface, with a share of its range.
_MISFIT_GREY, _MISFIT_SHARE = 1.5, 0.03
_CLEARLY = 1.05  # better is so much less misfit
_PLAIN = 0.5  # of a plain grey's misfit: more leaves no light to speak of, and noise fitted as some


@jit
def light_on(bins: FloatArray) -> tuple[FloatArray, bool]:
    """The light (3,) towards the camera, across it, and 1 if a side may lie in its own shadow.

    False where there is too little to see, or no light from afar that makes it look as it does.
    """
    count, used = 0.0, 0
    for j in range(BINS):
        if bins[j, COUNT] > 0.0:
            count += bins[j, COUNT]
            used += 1
            bins[j, ANGLE] /= bins[j, COUNT]
            bins[j, GREY] /= bins[j, COUNT]
        bins[j, COS], bins[j, SIN] = np.cos(bins[j, ANGLE]), np.sin(bins[j, ANGLE])
    light = np.zeros(3)
    if count < _LEAST_SAMPLES or used < _LEAST_BINS:
        return light, False
    all_lit = _fitted(bins, light)
    everywhere = _misfit(bins, all_lit, False)
    shadowed, least = _from_around(bins), np.inf
    for _ in range(_LIGHT_STEPS):
        misfit = _misfit(bins, shadowed, True)
        if misfit < least:
            light[:2], light[2], least = shadowed[:2], 1.0, misfit
        shadowed[2] = 1.0
        shadowed = _fitted(bins, shadowed)
    # Where no shadow is in sight both fit alike; one may then begin where the edge hides it.
    if least > _CLEARLY * everywhere:
        light[:2], light[2], least = all_lit[:2], 0.0, everywhere
    plain = np.zeros(3)
    plain[2] = np.sum(bins[:, COUNT] * bins[:, GREY]) / count
    if least > _PLAIN * _misfit(bins, plain, False):
        return light, False
    lowest, highest = np.inf, -np.inf
    for j in range(BINS):
        if bins[j, COUNT] > 0.0:
            lowest, highest = min(lowest, bins[j, GREY]), max(highest, bins[j, GREY])
    allowed = _MISFIT_GREY + _MISFIT_SHARE * (highest - lowest)
    return light, least < allowed * allowed * count


@jit
def _from_around(bins: FloatArray) -> FloatArray:
    """The best of light from _DIRECTIONS (3,): towards the camera, across, and level."""
    best, least = np.zeros(3), np.inf
    for k in range(_DIRECTIONS):
        around = 2.0 * np.pi * k / _DIRECTIONS
        fit = np.zeros(3)
        fit[0], fit[1] = np.cos(around), np.sin(around)
        n = sx = sy = sxx = sxy = 0.0
        for j in range(BINS):
            x = max(fit[0] * bins[j, COS] + fit[1] * bins[j, SIN], 0.0)
            n += bins[j, COUNT]
            sx += bins[j, COUNT] * x
            sy += bins[j, COUNT] * bins[j, GREY]
            sxx += bins[j, COUNT] * x * x
            sxy += bins[j, COUNT] * x * bins[j, GREY]
        strength = max((n * sxy - sx * sy) / max(n * sxx - sx * sx, 1e-6), 0.0)
        fit[0] *= strength
        fit[1] *= strength
        fit[2] = (sy - strength * sx) / n
        misfit = _misfit(bins, fit, True)
        if misfit < least:
            best, least = fit, misfit
    return best


@jit
def _fitted(bins: FloatArray, light: FloatArray) -> FloatArray:
    """Least squares (3,) of light towards the camera, across, and level, lit where ``light`` is."""
    m, rhs, row = np.zeros((3, 3)), np.zeros((3, 1)), np.empty(3)
    for j in range(BINS):
        n, grey = bins[j, COUNT], bins[j, GREY]
        row[0], row[1], row[2] = bins[j, COS], bins[j, SIN], 1.0
        if light[2] > 0.0 and light[0] * row[0] + light[1] * row[1] < 0.0:
            row[0] = row[1] = 0.0
        for i in range(3):
            rhs[i, 0] += n * row[i] * grey
            for k in range(i + 1):
                m[i, k] += n * row[i] * row[k]
    for i in range(3):
        m[i, i] += 1e-3
    cholesky(m)
    solve_column(m, rhs, 0)
    return rhs[:, 0].copy()


@jit
def _misfit(bins: FloatArray, fit: FloatArray, shadow: bool) -> float:
    """Sum of squares that ``fit`` (3,) leaves."""
    total = 0.0
    for j in range(BINS):
        lit = fit[0] * bins[j, COS] + fit[1] * bins[j, SIN]
        total += bins[j, COUNT] * (bins[j, GREY] - fit[2] - (max(lit, 0.0) if shadow else lit)) ** 2
    return total


@jit
def lit(light: FloatArray, angle: float) -> float:
    """The light on a surface whose normal is at ``angle`` from the direction to the camera."""
    falls = light[0] * np.cos(angle) + light[1] * np.sin(angle)
    return float(max(falls, 0.0)) if light[2] > 0.0 else float(falls)
