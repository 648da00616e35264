"""The sphere, equations (8) and (12): s = P0 / R, χ = 1/R."""

import numpy as np
from numpy.typing import NDArray

from estimator.cross import cross
from estimator.image.feature import Feature

FloatArray = NDArray[np.float64]


class Sphere:
    """ṡ = [s]× ω − v χ, χ̇ = 0 (12); hence Ω = −vᵀ (the paper prints vᵀ)."""

    @property
    def p(self) -> int:
        """One unknown, 1/R."""
        return 1

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        """The feature's s (3,)."""
        return np.array(feature.s, dtype=float)

    def position_and_axis(self, s: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """s (3,) itself, and no axis."""
        return s, None

    def chi_of_guess(self, s: FloatArray, radius_m: float) -> FloatArray:
        """(1/R,)."""
        return np.array([1.0 / radius_m])

    def inverse_radius(self, s: FloatArray, chi: FloatArray) -> float:
        """χ itself."""
        return float(chi[0])

    def f_m(self, s: FloatArray, u: FloatArray) -> FloatArray:
        """[s]× ω (..., 3)."""
        return cross(s, u[..., 3:])

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """−vᵀ (..., 1, 3)."""
        return -v[..., None, :]

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        """Zero: the radius does not change."""
        return np.zeros_like(chi)
