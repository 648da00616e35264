"""What the clutter beside a cylinder's sides goes on like where the blurred edge covers it.

Clutter varies smoothly along and across a side, so what lies under the edge can be told from what
is seen just outside of it: a linear prediction, learnt from the clutter further out (compiled).
"""

import numpy as np
from numpy.typing import NDArray

from estimator.image.edges_camera import GreyImage, bilinear
from estimator.image.intrinsics import FloatArray
from estimator.image.limb_linear import cholesky, solve_column
from estimator.image.limb_pixels import (
    CLUTTER,
    CLUTTER_VARIANCE,
    DISTANCE,
    NU,
    NV,
    TAU,
    U,
    V,
)
from estimator.jit import jit

# A strip beside each side: samples about 1 px apart along it, and so many outwards from where the
# image is pure background, _BEYOND_PX further than the edge reaches.
_LAYERS, _BEYOND_PX = 11, 0.3
_DEEP = 6  # px under the edge that are predicted
# The samples that predict: so many px along the side, the mean of both ways, and outwards.
_ALONG, _OUTWARDS = np.array([0, 1, 2, 4]), np.array([0, 1, 2, 4])
_RIDGE = 0.01  # of the variance, against weights that fit the few samples only
_NOISE_LEFT = 0.45  # of a pixel's variance, in a value between pixels
# Clutter is worth predicting when it varies more than the noise within so many px.
_ROUGH_WITHIN_PX, _LEAST_SAMPLES = 8, 60
_LEAST_PIXELS, _EVERY = 8, 4


@jit
def predict_clutter(
    image: GreyImage, pixels: FloatArray, starts: NDArray[np.int64], per_sector: int,
    reach_px: float, read_variance: float, mean: FloatArray,
) -> bool:  # fmt: skip
    """Fill the rows CLUTTER and CLUTTER_VARIANCE of the located ``pixels`` beside two sides.

    The image is pure background from ``reach_px`` outside the outline on; ``per_sector`` is a
    sector's length in px. CLUTTER is about each sector's level, which goes to the first column of
    ``mean`` (sectors, PHOTOMETRY). False, with nothing filled, where the background is too calm, or
    too little of it in view, for a prediction to help.
    """
    per_side = (starts.shape[0] - 1) // 2
    strips = np.empty((2, per_side * per_sector, _LAYERS))
    rough, levels = False, np.empty(2)
    for side in range(2):
        at = starts[side * per_side : (side + 1) * per_side + 1]
        _sample(image, pixels, at, per_sector, reach_px, strips[side, :, :1])
        roughness = _roughness(strips[side])
        if not roughness >= 0.0:
            return False
        rough = rough or roughness > (1.0 + _NOISE_LEFT) * read_variance
    if not rough:
        return False
    for side in range(2):
        at = starts[side * per_side : (side + 1) * per_side + 1]
        _sample(image, pixels, at, per_sector, reach_px, strips[side])
        levels[side], count = _centre(strips[side])
        if count < _LEAST_SAMPLES:
            return False
    for side in range(2):
        at = starts[side * per_side : (side + 1) * per_side + 1]
        weights, variance = _weights(strips[side], read_variance)
        predicted = _predicted(strips[side], weights)
        level = mean[side * per_side : (side + 1) * per_side, 0]
        _interpolate(pixels, at, per_sector, reach_px, predicted, variance, level)
        level += levels[side]
    return True


@jit
def _sample(
    image: GreyImage, pixels: FloatArray, starts: NDArray[np.int64], per_sector: int,
    reach_px: float, strip: FloatArray,
) -> None:  # fmt: skip
    """Grey (along, layers) beside one side's sectors; NaN where there is none."""
    strip[:] = np.nan
    for k in range(starts.shape[0] - 1):
        if starts[k + 1] - starts[k] < _LEAST_PIXELS:
            continue
        # The sector's outline is straight enough: a point of it, its normal and its length.
        n = fu = fv = nu = nv = tau = 0.0
        for i in range(starts[k], starts[k + 1], _EVERY):
            n += 1.0
            fu += pixels[U, i] - pixels[DISTANCE, i] * pixels[NU, i]
            fv += pixels[V, i] - pixels[DISTANCE, i] * pixels[NV, i]
            nu += pixels[NU, i]
            nv += pixels[NV, i]
            tau += pixels[TAU, i]
        fu, fv, nu, nv, tau = fu / n, fv / n, nu / n, nv / n, tau / n
        along = squares = 0.0
        for i in range(starts[k], starts[k + 1], _EVERY):
            by = pixels[TAU, i] - tau
            along += by * ((pixels[V, i] - fv) * nu - (pixels[U, i] - fu) * nv)
            squares += by * by
        length = along / max(squares, 1e-9)
        for i in range(per_sector):
            t = length * ((i + 0.5) / per_sector - 0.5 - tau)
            for m in range(strip.shape[1]):
                d = reach_px + _BEYOND_PX + m
                u, v = fu - nv * t - nu * d, fv + nu * t - nv * d
                strip[k * per_sector + i, m] = bilinear(image, u, v)


@jit
def _roughness(strip: FloatArray) -> float:
    """Variance of the innermost layer's grey within _ROUGH_WITHIN_PX; negative when unknown."""
    total, count = 0.0, 0
    for i in range(strip.shape[0] - _ROUGH_WITHIN_PX):
        change = strip[i + _ROUGH_WITHIN_PX, 0] - strip[i, 0]
        if change == change:
            total += 0.5 * change * change
            count += 1
    return total / count if count >= _LEAST_SAMPLES else -1.0


@jit
def _centre(strip: FloatArray) -> tuple[float, int]:
    """Subtract the mean; all of a row is NaN if some is. Returns it and how many rows are not."""
    total, count = 0.0, 0
    for i in range(strip.shape[0]):
        row = np.sum(strip[i])
        if row == row:
            total += row
            count += 1
        else:
            strip[i] = np.nan
    level = total / max(count * strip.shape[1], 1)
    strip -= level
    return level, count


@jit
def _samples(strip: FloatArray, i: int, base: int, out: FloatArray) -> bool:
    """The samples that predict at ``i`` along the strip into ``out``; False where there is none."""
    if np.isnan(strip[i, 0]):
        return False
    last = strip.shape[0] - 1
    w = 0
    for a in _ALONG:
        before, after = max(i - a, 0), min(i + a, last)
        if np.isnan(strip[before, 0]) or np.isnan(strip[after, 0]):
            before = after = i
        for m in _OUTWARDS:
            out[w] = 0.5 * (strip[before, base + m] + strip[after, base + m])
            w += 1
    return True


@jit
def _weights(strip: FloatArray, read_variance: float) -> tuple[FloatArray, FloatArray]:
    """Weights (samples, _DEEP + 1) of the samples, and the variance left unknown (_DEEP + 1,).

    Least squares of each layer on those further out, all of it pure background.
    """
    size = _ALONG.shape[0] * _OUTWARDS.shape[0]
    k, w = np.zeros((size, size)), np.zeros((size, _DEEP + 1))
    seen, own, count = np.empty(size), np.zeros(_DEEP + 1), 0
    for i in range(0, strip.shape[0], 2):
        if not _samples(strip, i, _DEEP, seen):
            continue
        count += 1
        for a in range(size):
            for b in range(a + 1):
                k[a, b] += seen[a] * seen[b]
            for deep in range(_DEEP + 1):
                w[a, deep] += seen[a] * strip[i, _DEEP - deep]
        for deep in range(_DEEP + 1):
            own[deep] += strip[i, _DEEP - deep] ** 2
    # The first layer "predicts" itself: its noise is not to be part of that.
    noise = min(_NOISE_LEFT * read_variance * count, 0.5 * own[0])
    w[0, 0] -= noise
    c = w.copy()
    for a in range(size):
        k[a, a] *= 1.0 + _RIDGE
    cholesky(k)
    variance = np.empty(_DEEP + 1)
    for deep in range(_DEEP + 1):
        solve_column(k, w, deep)
        unknown = own[deep] - noise
        for a in range(size):
            unknown -= w[a, deep] * c[a, deep]
        variance[deep] = max(unknown, 0.0) / max(count - size, 1)
    return w, variance


@jit
def _predicted(strip: FloatArray, weights: FloatArray) -> FloatArray:
    """Clutter (along, _DEEP + 1) under the edge."""
    out = np.zeros((strip.shape[0], _DEEP + 1))
    seen = np.empty(weights.shape[0])
    for i in range(strip.shape[0]):
        if _samples(strip, i, 0, seen):
            for a in range(weights.shape[0]):
                for deep in range(_DEEP + 1):
                    out[i, deep] += weights[a, deep] * seen[a]
    return out


@jit
def _interpolate(
    pixels: FloatArray, starts: NDArray[np.int64], per_sector: int, reach_px: float,
    predicted: FloatArray, variance: FloatArray, level: FloatArray,
) -> None:  # fmt: skip
    """The prediction at one side's pixels, about each sector's mean across the edge: ``level``."""
    for k in range(starts.shape[0] - 1):
        total = n = 0.0
        for i in range(starts[k], starts[k + 1]):
            x = pixels[DISTANCE, i] + reach_px + _BEYOND_PX
            x = min(max(x, 0.0), _DEEP - 1e-6)
            t = (k + pixels[TAU, i] + 0.5) * per_sector - 0.5
            t = min(max(t, 0.0), predicted.shape[0] - 1.001)
            row, deep = int(t), int(x)
            ft, fx = t - row, x - deep
            near = (1.0 - ft) * predicted[row, deep] + ft * predicted[row + 1, deep]
            far = (1.0 - ft) * predicted[row, deep + 1] + ft * predicted[row + 1, deep + 1]
            pixels[CLUTTER, i] = (1.0 - fx) * near + fx * far
            pixels[CLUTTER_VARIANCE, i] = (1.0 - fx) * variance[deep] + fx * variance[deep + 1]
            if abs(pixels[DISTANCE, i]) < reach_px:
                total += pixels[CLUTTER, i]
                n += 1.0
        level[k] = total / max(n, 1.0)
        for i in range(starts[k], starts[k + 1]):
            pixels[CLUTTER, i] -= level[k]
