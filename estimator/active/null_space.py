"""Which way around the target tells most, while a servo keeps it in its place."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from estimator.active.information import displacements, variance_decrease
from estimator.active.room import Walls, room_for
from estimator.estimate import Estimate

FloatArray = NDArray[np.float64]

_DIRECTIONS = 16
_HORIZON_S = 0.5
# Another direction has to leave less than this share of the variance that going on leaves.
_WORTH_TURNING = 0.7
_ACCELERATION_M_S2 = 1.0


class AroundTarget:
    """A velocity across the line of sight, chosen for the least var(χ) half a second later.

    To these velocities a rotation belongs that keeps the target where it is in the image: with it
    they move the camera around the target, and s stands still. ``prefer`` (3,) is where to go
    while nothing is known, and ``walls()`` says how much room there is.
    """

    def __init__(self, prefer: FloatArray, walls: Callable[[], Walls | None]) -> None:
        self._wanted = np.array(prefer, dtype=float)
        self._walls = walls
        self._v = np.zeros(3)

    def velocity(
        self, estimate: Estimate, along: FloatArray, speed_m_s: float, dt_s: float
    ) -> FloatArray:
        """v (3,) of at most ``speed_m_s``, across the line of sight and a cylinder's axis.

        ``along`` (3,) is the velocity that the servo adds. It changes at a bounded rate.
        """
        sight = estimate.s / float(np.linalg.norm(estimate.s))
        wanted = np.zeros(3)
        if speed_m_s > 0.0:
            self._wanted = self._direction(estimate, sight, along, speed_m_s)
            wanted = speed_m_s * self._wanted
        step = wanted - self._v
        longest = _ACCELERATION_M_S2 * dt_s
        length = float(np.linalg.norm(step))
        v = self._v + (step if length <= longest else step * (longest / length))
        self._v = v - sight * float(sight @ v)
        return self._v.copy()

    def _direction(
        self, estimate: Estimate, sight: FloatArray, along: FloatArray, speed_m_s: float
    ) -> FloatArray:
        """The best of the unit directions (3,); going on as before is the first candidate."""
        candidates = _across(sight, estimate.axis, self._wanted)
        left = np.zeros(len(candidates))
        if estimate.covariance is not None and estimate.image_covariance is not None:
            velocities = speed_m_s * candidates + along
            left = float(estimate.covariance[3, 3]) - variance_decrease(
                estimate.covariance,
                estimate.image_covariance,
                displacements(velocities, _HORIZON_S, estimate.axis),
            )
        free = room_for(candidates, speed_m_s * _HORIZON_S, self._walls())
        left = np.where(free, left, math.inf)
        best = int(np.argmin(left))
        return np.asarray(candidates[best if left[best] < _WORTH_TURNING * left[0] else 0])


def _across(sight: FloatArray, axis: FloatArray | None, first: FloatArray) -> FloatArray:
    """Unit directions (n, 3) across the line of sight, the first as near ``first`` as can be.

    All around for a sphere; for a cylinder the two that are across its axis too.
    """
    if axis is not None:
        around = np.cross(axis, sight)
        around /= float(np.linalg.norm(around))
        sign = 1.0 if float(around @ first) >= 0.0 else -1.0
        return sign * np.array([around, -around])
    ahead = first - sight * float(sight @ first)
    if float(np.linalg.norm(ahead)) < 1e-6:
        ahead = np.cross(sight, np.eye(3)[int(np.argmin(np.abs(sight)))])
    ahead = ahead / float(np.linalg.norm(ahead))
    angles = 2.0 * math.pi * np.arange(_DIRECTIONS)[:, None] / _DIRECTIONS
    return np.asarray(np.cos(angles) * ahead + np.sin(angles) * np.cross(sight, ahead))
