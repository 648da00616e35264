"""How noisy the pixels and how varied the light around an outline are, learnt from the fit."""

import numpy as np

from estimator.image.intrinsics import FloatArray
from estimator.image.limb_edge import PHOTOMETRY
from estimator.image.limb_normal import N_IN, N_OUT, SS_IN, SS_OUT
from estimator.jit import jit

_LEAST_READ_VARIANCE = 0.1  # rounding to whole grey levels is 1/12
# A side's shading stands out from five standard deviations on, and from 0.3 grey per px.
_STANDS_OUT, _NO_SHADING = 25.0, 0.1
# A departure from foretold shading is chance up to so many standard deviations, and smaller than
# half a grey per px (per root of a px) it is not worth the freedom it takes.
_CHANCE_SD, _FORETOLD_VARIANCE = 2.0, 0.25


@jit
def noise_levels(stats: FloatArray, noise: FloatArray, texture_weight: float) -> None:
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
def learn_shading(
    photometry: FloatArray, spread: FloatArray, stats: FloatArray, mean: FloatArray
) -> None:
    """Expect each side of a cylinder to be shaded alike all along it.

    Its normal is the same all along, so the level is about its mean, and so are the slopes across
    and the limb terms, as far as their means stand out.
    """
    per_side = photometry.shape[0] // 2
    for side in range(2):
        first, last = side * per_side, (side + 1) * per_side
        for j in (3, 5, 6):
            total = doubt = count = 0.0
            for k in range(first, last):
                if stats[k, N_IN] >= 6.0:
                    total += photometry[k, j]
                    doubt += spread[k, j]
                    count += 1.0
            level, variance = total / max(count, 1.0), doubt / max(count, 1.0) ** 2
            noise = _STANDS_OUT * variance + _NO_SHADING if j > 3 else 0.0
            mean[first:last, j] = level * max(0.0, 1.0 - noise / (level * level + 1e-12))


@jit
def learn_ridge(
    photometry: FloatArray, spread: FloatArray, stats: FloatArray, ridge: FloatArray,
    mean: FloatArray, first: bool, cylinder: bool, predicted: bool,
    shaded: bool,
) -> None:  # fmt: skip
    """Learn from all sectors how large slopes and limb terms are here (empirical Bayes).

    ``first``: p was found almost without a prior, so that its own scatter is subtracted, and four
    standard deviations of what that leaves uncertain are added; later the usual expectation step.
    ``cylinder``: its sides' levels are about their means, and their scatter is learnt too.
    ``predicted``: the background is known from elsewhere, and only the target's terms are learnt.
    ``shaded``: so is the target's shading, and what departs from it is to stand out.
    """
    square = np.zeros(PHOTOMETRY)
    scatter = np.zeros(PHOTOMETRY)
    count = 0
    for k in range(photometry.shape[0]):
        if stats[k, N_IN] + stats[k, N_OUT] < 6.0:
            continue
        count += 1
        for j in range(PHOTOMETRY):
            square[j] += (photometry[k, j] - mean[k, j]) ** 2
            scatter[j] += spread[k, j]
    if count == 0:
        return
    for j in range(1, PHOTOMETRY):
        if (predicted and j < 3) or (j == 3 and (first or not cylinder)):
            continue
        second = (square[j] + scatter[j]) / count
        if first:
            second = max(square[j] - scatter[j], 0.0) / count
            second += 4.0 * scatter[j] / count * np.sqrt(2.0 / count)
        if shaded and j > 4:
            if first:
                chance = scatter[j] * (1.0 + _CHANCE_SD * np.sqrt(2.0 / count))
                second = max(square[j] - chance, 0.0) / count
            second = max(second, _FORETOLD_VARIANCE)
        ridge[j] = 1.0 / max(second, 1e-4)
