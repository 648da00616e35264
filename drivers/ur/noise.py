"""How much the reported twist of an arm at rest wanders."""

import numpy as np
from numpy.typing import NDArray

from drivers.ur.ring import Sample

FloatArray = NDArray[np.float64]

FEWEST_SAMPLES = 25
_MOVING = 1e-3  # m/s and rad/s on the mean


def noise_at_rest(samples: list[Sample]) -> FloatArray | None:
    """Covariance (6, 6) of the reported twist of an arm that rests, alike in all directions.

    None where the samples are too few or the arm moves: then nobody knows it.
    """
    twists = np.array([sample.twist_base for sample in samples])
    if len(twists) < FEWEST_SAMPLES or float(np.abs(twists.mean(axis=0)).max()) > _MOVING:
        return None
    std = twists.std(axis=0)
    linear, angular = (float(np.sqrt(np.mean(part**2))) for part in (std[:3], std[3:]))
    return np.diag(np.repeat([linear**2, angular**2], 3))
