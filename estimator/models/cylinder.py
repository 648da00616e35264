"""The cylinder, equation (20), its measured axis a part of the state: s = (P0 / R, a)."""

import numpy as np
from numpy.typing import NDArray

from estimator.cross import cross
from estimator.image.feature import Feature

FloatArray = NDArray[np.float64]


class Cylinder:
    """ṡ = [s]× ω + (a aᵀ − I) v χ, ȧ = [a]× ω, χ̇ = 0 (20); P0 is the axis point nearest to the
    camera and χ = 1/R.

    The state is (s, a) (6,), so Ωᵀ is (a aᵀ − I) v above three zeros.
    """

    @property
    def p(self) -> int:
        """One unknown, 1/R."""
        return 1

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        """(s, a) (6,), a pointing the way of the axis in ``near``; ValueError without an axis."""
        if feature.axis is None:
            raise ValueError("a cylinder's feature must carry the direction of its axis")
        axis = feature.axis
        if near is not None and float(axis @ near[3:]) < 0.0:
            axis = -axis
        return np.concatenate((feature.s, axis))

    def position_and_axis(self, s: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """The two halves of s (6,), the axis scaled to unit length."""
        axis: FloatArray = s[3:] / np.linalg.norm(s[3:])
        return s[:3], axis

    def chi_of_guess(self, s: FloatArray, radius_m: float) -> FloatArray:
        """(1/R,)."""
        return np.array([1.0 / radius_m])

    def inverse_radius(self, s: FloatArray, chi: FloatArray) -> float:
        """χ itself."""
        return float(chi[0])

    def f_m(self, s: FloatArray, u: FloatArray) -> FloatArray:
        """([s]× ω, [a]× ω) (..., 6)."""
        halves = s.reshape(*s.shape[:-1], 2, 3)
        return cross(halves, u[..., None, 3:]).reshape(s.shape)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """(vᵀ (a aᵀ − I), 0) (..., 1, 6)."""
        a = s[..., 3:]
        along = (a * v).sum(axis=-1, keepdims=True)
        rows = np.zeros((*s.shape[:-1], 1, 6))
        rows[..., 0, :3] = a * along - v
        return rows

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        """Zero: the radius does not change."""
        return np.zeros_like(chi)
