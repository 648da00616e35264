"""Which pieces of a refined outline show the edge that was fitted to them (compiled)."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import FloatArray
from estimator.image.limb_normal import CHI_EDGE, N_EDGE, SHIFT, SHIFT_INFO
from estimator.jit import jit

BoolArray = NDArray[np.bool_]

_LEAST_FILLED = 0.4  # of the usual number of pixels
# A sector is usable when its contrast stands out of the noise, it alone would put the edge near
# where the others do, and its residuals across the edge are about as large as they should be.
_LEAST_CONTRAST_GREY, _LEAST_CONTRAST_SD = 6.0, 2.0
_MOST_SHIFT_PX, _MOST_SHIFT_SD, _MOST_SHIFT_STD_PX, _MOST_CHI2 = 0.5, 4.0, 0.5, 6.0


@jit
def in_view(starts: NDArray[np.int64]) -> BoolArray:
    """Which sectors (n,) are not cut away by the image's border, from `collect`'s ``starts``."""
    sectors = starts.shape[0] - 1
    filled = np.empty(sectors)
    some = 0
    for k in range(sectors):
        if starts[k + 1] > starts[k]:
            filled[some] = starts[k + 1] - starts[k]
            some += 1
    enough = np.zeros(sectors, np.bool_)
    if some > 0:
        least = _LEAST_FILLED * np.median(filled[:some])
        for k in range(sectors):
            enough[k] = starts[k + 1] - starts[k] > least
    return enough


@jit
def verdict(
    photometry: FloatArray, stats: FloatArray, noise: FloatArray, seen: BoolArray
) -> tuple[BoolArray, float]:
    """Which of the sectors ``seen`` (n,) are usable, and the edge pixels' mean squared residual.

    The latter is over what is expected, so about 1; the arguments are `solve_outline`'s.
    """
    contrast = photometry[:, 3] - photometry[:, 0]
    sign = 1.0 if np.median(contrast[seen]) > 0.0 else -1.0
    least = max(_LEAST_CONTRAST_GREY, _LEAST_CONTRAST_SD * np.sqrt(noise[0, 0]))
    usable = np.zeros(seen.shape[0], np.bool_)
    n_edge = chi2 = 0.0
    for k in range(seen.shape[0]):
        n_edge += stats[k, N_EDGE]
        chi2 += stats[k, CHI_EDGE]
        if not seen[k]:
            continue
        std = 1.0 / np.sqrt(max(stats[k, SHIFT_INFO], 1e-12))
        most_px = _MOST_SHIFT_PX + _MOST_SHIFT_SD * min(std, 0.2)
        placed = abs(stats[k, SHIFT]) < most_px and std < _MOST_SHIFT_STD_PX
        here = stats[k, N_EDGE]
        fits = here > 0.0 and stats[k, CHI_EDGE] < _MOST_CHI2 * here
        usable[k] = sign * contrast[k] > least and placed and fits
    return usable, chi2 / max(n_edge, 1.0)
