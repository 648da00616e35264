"""Points seen along an exactly known motion, and their true (s, χ) in both parametrisations."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.feature import Feature
from estimator.models.bearings import Bearings
from estimator.models.points import Points
from tests.estimator.exact_motion import Target, Trajectory

FloatArray = NDArray[np.float64]

# In the camera's frame at t = 0.
THREE = np.array([[0.03, -0.02, 0.5], [-0.12, 0.06, 0.4], [0.1, 0.11, 0.65]])


def seen_points(P_m: FloatArray, std: float = 1e-4) -> Feature:
    """The image of points P (n, 3) in the camera's frame."""
    s = (P_m[:, :2] / P_m[:, 2:]).ravel()
    return Feature(s, std**2 * np.eye(s.size))


def points_at(motion: Trajectory, points_m: FloatArray, t_s: float) -> FloatArray:
    """Where the points (n, 3) are in the camera's frame at ``t_s``."""
    return np.array([motion.feature(Target(point, 1.0), t_s).s for point in points_m])


def truth(model: Points | Bearings, P_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """s (m,) and χ (n,) of points P (n, 3) in the camera's frame, from geometry alone."""
    if isinstance(model, Points):
        return (P_m[:, :2] / P_m[:, 2:]).ravel(), 1.0 / P_m[:, 2]
    range_m = np.linalg.norm(P_m, axis=1)
    return (P_m / range_m[:, None]).ravel(), 1.0 / range_m
