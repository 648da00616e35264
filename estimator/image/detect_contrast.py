"""How well an outline stands out in the image (compiled)."""

import numpy as np

from estimator.image.edges_camera import GreyImage, bilinear
from estimator.image.intrinsics import FloatArray
from estimator.jit import jit

_SOFT_GREY = 15.0
_NEAR_PX, _STEP_PX, _SAMPLES = 2.0, 1.5, 3


@jit
def side_contrast(image: GreyImage, normals: FloatArray) -> float:
    """Mean over an outline of c / (|c| + 15), c inner minus outer grey; between -1 and 1.

    Only what changes within a few pixels counts: shading across the target changes slowly.
    """
    total, count = 0.0, 0
    for i in range(normals.shape[0]):
        u, v, nu, nv = normals[i, 0], normals[i, 1], normals[i, 2], normals[i, 3]
        difference = 0.0
        for k in range(_SAMPLES):
            d = _NEAR_PX + k * _STEP_PX
            inner = bilinear(image, u - d * nu, v - d * nv)
            outer = bilinear(image, u + d * nu, v + d * nv)
            difference += (inner - outer) / _SAMPLES
        if np.isfinite(difference):
            total += difference / (abs(difference) + _SOFT_GREY)
            count += 1
    return total / max(count, 1)
