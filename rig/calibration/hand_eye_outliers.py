"""Poses that contradict the others: images paired with the wrong pose, a board that was moved."""

import numpy as np
from numpy.typing import NDArray

from rig.calibration.hand_eye_model import Linear, Noise
from rig.calibration.hand_eye_noise import arm_deviations

FloatArray = NDArray[np.float64]

_RATIO = 6.0  # this many times the median deviation is an outlier
_LEAST_M, _LEAST_RAD = 2e-4, 5e-4  # deviations below these never are
_SIGMAS = 4.0  # nor what the corners' own noise explains


def misfits(linear: Linear, noise: Noise) -> dict[int, str]:
    """Index of each outlying view with how far the arm would have to stand elsewhere.

    Only the worst third of what exceeds the bound at once: one bad pose pulls others along.
    """
    moved = arm_deviations(linear)
    normal = np.swapaxes(linear.by_arm, 1, 2) @ linear.by_arm
    own = noise.corner_px * np.sqrt(np.diagonal(np.linalg.inv(normal), axis1=1, axis2=2))
    score = np.zeros(len(moved))
    sizes = []
    for part, least in ((slice(0, 3), _LEAST_M), (slice(3, 6), _LEAST_RAD)):
        size = np.linalg.norm(moved[:, part], axis=1)
        explained = _SIGMAS * np.linalg.norm(own[:, part], axis=1)
        bound = np.maximum(max(_RATIO * float(np.median(size)), least), explained)
        score = np.maximum(score, size / bound)
        sizes.append(size)
    over = np.flatnonzero(score > 1.0)
    worst = over[np.argsort(-score[over])][: max(1, -(-len(over) // 3))]
    return {
        int(i): f"arm and image disagree by {1e3 * sizes[0][i]:.2f} mm and "
        f"{np.degrees(sizes[1][i]):.2f}°, the median pose by {1e3 * np.median(sizes[0]):.2f} mm "
        f"and {np.degrees(np.median(sizes[1])):.2f}°"
        for i in worst
    }
