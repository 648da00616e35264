"""A plain arc, as an expert would move the camera by hand."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


class CircularVelocity:
    """v of constant norm that turns about the optical axis: a circle of ``radius_m``.

    It starts along the part of ``v0`` (3,) that is in the image plane, or along x without one.
    Raises ValueError for a v0 that is zero or a radius that is not positive.
    """

    def __init__(self, v0: ArrayLike, radius_m: float) -> None:
        v = np.array(v0, dtype=float)
        speed = float(np.linalg.norm(v)) if v.shape == (3,) else math.nan
        if not (0.0 < speed < math.inf and radius_m > 0.0):
            raise ValueError(f"a circle needs a velocity and a radius, not {v0!r}, {radius_m!r}")
        self._speed_m_s = speed
        self._rate_rad_s = speed / radius_m
        self._angle_rad = math.atan2(v[1], v[0]) if np.any(v[:2]) else 0.0

    @property
    def v(self) -> FloatArray:
        """The velocity (3,) wanted now, in m/s."""
        angle = self._angle_rad
        return self._speed_m_s * np.array([math.cos(angle), math.sin(angle), 0.0])

    def advance(self, axis: FloatArray | None, omega: FloatArray, dt_s: float) -> None:
        """Let ``dt_s`` pass."""
        self._angle_rad += self._rate_rad_s * dt_s
