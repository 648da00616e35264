"""What no unbiased estimator can do better than: the Cramér-Rao bound of a run."""

import math

import numpy as np
from numpy.typing import NDArray

from estimator.displacement import displacement
from estimator.image.feature import Feature
from estimator.kalman_step import moved, seen
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]

# Nothing is known beforehand: this many times χ itself.
_IGNORANCE = 1e4


def cramer_rao(
    times_s: FloatArray, features: list[Feature], chi: float, motion: TwistHistory
) -> FloatArray:
    """The least standard deviation of χ (k,) after each of k images with these covariances.

    ``times_s`` (k,) are the exposures, ``chi`` is the true χ; ``motion`` must cover them all and
    bear the covariance of its twists, which counts as white noise; without one it is exact. For
    the linear system with Gaussian noise that the targets are, the bound is the Kalman filter's
    variance at the true state. Raises MotionUnknownError where the motion is not known.
    """
    spectrum = motion.spectrum(np.zeros((6, 6)))
    out = np.empty(len(features))
    P = np.zeros((4, 4))
    for k, feature in enumerate(features):
        axis = np.zeros(3) if feature.axis is None else np.array(feature.axis, dtype=float)
        image = np.array(feature.covariance, dtype=float)
        x = np.append(feature.s, chi)
        if k == 0:
            P[:3, :3], P[3, 3] = image, (_IGNORANCE * chi) ** 2
        else:
            window = motion.window(float(times_s[k - 1]), float(times_s[k]))
            R, d = displacement(window.times_s, window.twists_camera)
            x_before = np.append(R.T @ (feature.s + chi * d), chi)
            # Unlike the filter the bound knows χ where the noise of v is multiplied by it, and
            # counts the slowest motion.
            _, noise = moved(
                x_before, np.zeros((4, 4)), R, d, axis, spectrum, _passed(times_s, k), 0.0
            )
            _, P = moved(x_before, P, R, d, axis, 0.0 * spectrum, _passed(times_s, k), 0.0)
            P = P + noise
            _, P, _ = seen(x, P, x[:3].copy(), image, axis)
        out[k] = math.sqrt(P[3, 3])
    return out


def _passed(times_s: FloatArray, k: int) -> float:
    return float(times_s[k] - times_s[k - 1])
