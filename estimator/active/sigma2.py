"""σ1², how fast the structure can be estimated, and its Jacobians: equations (21), (22).

``axis`` is the cylinder's unit axis a, or None for the sphere, whose σ1² is ‖v‖².
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def useful_velocity(v: FloatArray, axis: FloatArray | None) -> FloatArray:
    """(I − a aᵀ) v (..., 3): the part of v that tells about the radius; v itself for a sphere."""
    if axis is None:
        return v
    useful: FloatArray = v - axis * (axis * v).sum(axis=-1, keepdims=True)
    return useful


def sigma2(v: FloatArray, axis: FloatArray | None) -> FloatArray:
    """σ1² = ‖v‖² − (aᵀ v)² (...), eq. (21), of velocities (..., 3) and axes (..., 3)."""
    squares: FloatArray = np.asarray((useful_velocity(v, axis) ** 2).sum(axis=-1))
    return squares


def J_v(v: FloatArray, axis: FloatArray | None) -> FloatArray:
    """∂σ1²/∂v = 2 vᵀ (I − a aᵀ) (3,)."""
    return 2.0 * useful_velocity(v, axis)


def J_a(v: FloatArray, axis: FloatArray | None) -> FloatArray:
    """∂σ1²/∂a = −2 (vᵀ a) vᵀ (3,), the printed sign corrected; zero for the sphere."""
    if axis is None:
        return np.zeros(3)
    return -2.0 * float(v @ axis) * v
