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
from estimator.jit import jit, jit_sums

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
    strips = np.empty((2, _LAYERS, per_side * per_sector))
    seen, levels, counts = np.empty(strips.shape[::2]), np.empty(2), np.zeros(2, np.int64)
    rough = False
    for side in range(2):
        at = starts[side * per_side : (side + 1) * per_side + 1]
        _sample(image, pixels, at, per_sector, reach_px, strips[side, :1])
        roughness = _roughness(strips[side])
        if not roughness >= 0.0:
            return False
        rough = rough or roughness > (1.0 + _NOISE_LEFT) * read_variance
    if not rough:
        return False
    for side in range(2):
        at = starts[side * per_side : (side + 1) * per_side + 1]
        _sample(image, pixels, at, per_sector, reach_px, strips[side])
        levels[side], counts[side] = _centre(strips[side], seen[side])
        if counts[side] < _LEAST_SAMPLES:
            return False
    for side in range(2):
        at = starts[side * per_side : (side + 1) * per_side + 1]
        samples = np.empty((_ALONG.shape[0] * _OUTWARDS.shape[0], strips.shape[2]))
        _fill_samples(strips[side], seen[side], _DEEP, samples)
        weights, variance = _weights(strips[side], samples, counts[side], read_variance)
        _fill_samples(strips[side], seen[side], 0, samples)
        predicted = _predicted(samples, weights)
        level = mean[side * per_side : (side + 1) * per_side, 0]
        _interpolate(pixels, at, per_sector, reach_px, predicted, variance, level)
        level += levels[side]
    return True


@jit
def _sample(
    image: GreyImage, pixels: FloatArray, starts: NDArray[np.int64], per_sector: int,
    reach_px: float, strip: FloatArray,
) -> None:  # fmt: skip
    """Grey (layers, along) beside one side's sectors; NaN where there is none."""
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
            for m in range(strip.shape[0]):
                d = reach_px + _BEYOND_PX + m
                u, v = fu - nv * t - nu * d, fv + nu * t - nv * d
                strip[m, k * per_sector + i] = bilinear(image, u, v)


@jit
def _roughness(strip: FloatArray) -> float:
    """Variance of the innermost layer's grey within _ROUGH_WITHIN_PX; negative when unknown."""
    total, count = 0.0, 0
    for i in range(strip.shape[1] - _ROUGH_WITHIN_PX):
        change = strip[0, i + _ROUGH_WITHIN_PX] - strip[0, i]
        if change == change:
            total += 0.5 * change * change
            count += 1
    return total / count if count >= _LEAST_SAMPLES else -1.0


@jit
def _centre(strip: FloatArray, seen: FloatArray) -> tuple[float, int]:
    """Subtract the mean, which it returns, and how many places along the strip are all seen.

    ``seen`` (along,) is filled with 1 there and 0 elsewhere, where the strip is then zero.
    """
    total, count = 0.0, 0
    for i in range(strip.shape[1]):
        grey = np.sum(strip[:, i])
        seen[i] = 1.0 if grey == grey else 0.0
        if grey == grey:
            total += grey
            count += 1
    level = total / max(count * strip.shape[0], 1)
    for m in range(strip.shape[0]):
        for i in range(strip.shape[1]):
            strip[m, i] = strip[m, i] - level if seen[i] > 0.0 else 0.0
    return level, count


@jit
def _fill_samples(strip: FloatArray, seen: FloatArray, base: int, samples: FloatArray) -> None:
    """The samples (samples, along) that predict what is inwards of layer ``base``; 0 if unseen."""
    last = strip.shape[1] - 1
    both = np.empty((2, strip.shape[1]), dtype=np.int64)
    w = 0
    for a in _ALONG:
        for i in range(strip.shape[1]):
            both[0, i], both[1, i] = max(i - a, 0), min(i + a, last)
            if seen[both[0, i]] * seen[both[1, i]] == 0.0:
                both[0, i] = both[1, i] = i
        for m in _OUTWARDS:
            for i in range(strip.shape[1]):
                grey = strip[base + m, both[0, i]] + strip[base + m, both[1, i]]
                samples[w, i] = 0.5 * seen[i] * grey
            w += 1


@jit_sums
def _weights(
    strip: FloatArray, samples: FloatArray, count: int, read_variance: float
) -> tuple[FloatArray, FloatArray]:
    """Weights (samples, _DEEP + 1) of the samples, and the variance left unknown (_DEEP + 1,).

    Least squares of each layer on those further out, all of it pure background.
    """
    size = samples.shape[0]
    k, w, own = np.empty((size, size)), np.empty((size, _DEEP + 1)), np.empty(_DEEP + 1)
    for a in range(size):
        for b in range(a + 1):
            k[a, b] = _product(samples[a], samples[b])
        for deep in range(_DEEP + 1):
            w[a, deep] = _product(samples[a], strip[_DEEP - deep])
    for deep in range(_DEEP + 1):
        own[deep] = _product(strip[_DEEP - deep], strip[_DEEP - deep])
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


@jit_sums
def _product(one: FloatArray, other: FloatArray) -> float:
    total = 0.0
    for i in range(one.shape[0]):
        total += one[i] * other[i]
    return total


@jit_sums
def _predicted(samples: FloatArray, weights: FloatArray) -> FloatArray:
    """Clutter (_DEEP + 1, along) under the edge."""
    out = np.zeros((_DEEP + 1, samples.shape[1]))
    for deep in range(_DEEP + 1):
        for a in range(weights.shape[0]):
            weight = weights[a, deep]
            for i in range(samples.shape[1]):
                out[deep, i] += weight * samples[a, i]
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
            t = min(max(t, 0.0), predicted.shape[1] - 1.001)
            at, deep = int(t), int(x)
            ft, fx = t - at, x - deep
            near = (1.0 - ft) * predicted[deep, at] + ft * predicted[deep, at + 1]
            far = (1.0 - ft) * predicted[deep + 1, at] + ft * predicted[deep + 1, at + 1]
            pixels[CLUTTER, i] = (1.0 - fx) * near + fx * far
            pixels[CLUTTER_VARIANCE, i] = (1.0 - fx) * variance[deep] + fx * variance[deep + 1]
            if abs(pixels[DISTANCE, i]) < reach_px:
                total += pixels[CLUTTER, i]
                n += 1.0
        level[k] = total / max(n, 1.0)
        for i in range(starts[k], starts[k + 1]):
            pixels[CLUTTER, i] -= level[k]
