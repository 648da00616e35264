"""The camera's angular velocity that keeps the target at the centre of the image."""

import numpy as np
from numpy.typing import NDArray

from estimator.active.sigma2 import useful_velocity

FloatArray = NDArray[np.float64]

# A target in front of the camera has s_z > 1; nearer the plane of the lens ω would blow up.
_LEAST_S_Z = 1.0


def centring_omega(
    s: FloatArray, axis: FloatArray | None, chi: float, v: FloatArray, gain_per_s: float
) -> FloatArray:
    """ω (3,) with which ṡ_x = −k s_x and ṡ_y = −k s_y for the target at s (3,), eq. (12), (20).

    ω_x and ω_y undo what v (3,) does to s with χ̂ (feedforward) and take s_x, s_y to zero
    (feedback at ``gain_per_s``); ω_z, the spin about the optical axis, is not needed and zero.
    For s_z < 1, which no target in view has, the law stays bounded as if s_z were 1.
    """
    drift = -useful_velocity(v, axis) * chi
    s_z = max(float(s[2]), _LEAST_S_Z)
    return np.array(
        [
            -(gain_per_s * s[1] + drift[1]) / s_z,
            (gain_per_s * s[0] + drift[0]) / s_z,
            0.0,
        ]
    )
