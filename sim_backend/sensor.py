"""The image sensor: from radiance to noisy 8-bit grey levels."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from sim_backend.jit import jit

_TABLE_SIZE = 1 << 16
# Normal deviates at evenly spaced probabilities: 16 random bits pick one. Reaches ±4.3 σ.
_NORMAL = ndtri((np.arange(_TABLE_SIZE) + 0.5) / _TABLE_SIZE).astype(np.float32)
_NORMAL /= _NORMAL.std()


def expose(
    radiance: NDArray[np.float32],
    gain: NDArray[np.float32],
    noise_grey: float,
    key: int,
) -> NDArray[np.uint8]:
    """Grey levels (height, width) of ``radiance`` times ``gain``, with Gaussian read noise.

    The noise is a function of ``key`` and the pixel alone, not of what was exposed before.
    """
    image = np.empty(radiance.shape, np.uint8)
    _expose(radiance, gain, np.float32(noise_grey), np.uint64(key), _NORMAL, image)
    return image


@jit
def _expose(
    radiance: NDArray[np.float32],
    gain: NDArray[np.float32],
    noise_grey: np.float32,
    key: np.uint64,
    normal: NDArray[np.float32],
    image: NDArray[np.uint8],
) -> None:
    height, width = radiance.shape
    state = key
    for v in range(height):
        bits = np.uint64(0)
        for u in range(width):
            if u % 4 == 0:  # SplitMix64: one step yields 64 bits, enough for four pixels
                state += np.uint64(0x9E3779B97F4A7C15)
                bits = state
                bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
                bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
                bits = bits ^ (bits >> np.uint64(31))
            grey = radiance[v, u] * gain[v, u] + noise_grey * normal[bits & np.uint64(0xFFFF)]
            bits = bits >> np.uint64(16)
            image[v, u] = np.uint8(min(max(grey + np.float32(0.5), np.float32(0)), np.float32(255)))
