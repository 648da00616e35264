"""The sphere, equations (8) and (12): s = P0 / R, χ = 1/R."""

import numpy as np
from numpy.typing import NDArray

from estimator.flow import follow, structures
from estimator.image.feature import Feature
from estimator.jit import jit, jit_template

FloatArray = NDArray[np.float64]


class Sphere:
    """ṡ = [s]× ω − v χ, χ̇ = 0 (12); hence Ω = −vᵀ (the paper prints vᵀ)."""

    @property
    def m(self) -> int:
        """Three: the centre in radii."""
        return 3

    @property
    def p(self) -> int:
        """One unknown, 1/R."""
        return 1

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        """The feature's s (3,)."""
        return np.array(feature.s, dtype=float)

    def shown(self, s: FloatArray) -> FloatArray:
        """s (3,) itself."""
        return s

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
        """[s]× ω (3,)."""
        return _f_m(s, u)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """−vᵀ (1, 3)."""
        return _Omega(s, v)

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        """Zero: the radius does not change."""
        return _f_u(s, chi, u)

    def flow(
        self, s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """See ``Model.flow``."""
        return _flow(s0, chi0, times_s, twists)

    def structures(self, s: FloatArray, twists: FloatArray) -> FloatArray:
        """See ``Model.structures``."""
        return _structures(s, twists)


@jit_template
def _f_m(s: FloatArray, u: FloatArray) -> FloatArray:
    wx, wy, wz = u[3], u[4], u[5]
    return np.array([s[1] * wz - s[2] * wy, s[2] * wx - s[0] * wz, s[0] * wy - s[1] * wx])


@jit_template
def _Omega(s: FloatArray, v: FloatArray) -> FloatArray:
    return np.array([[-v[0], -v[1], -v[2]]])


@jit_template
def _f_u(s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
    return np.zeros(1)


@jit
def _flow(
    s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
) -> tuple[FloatArray, FloatArray]:
    return follow(_f_m, _Omega, _f_u, s0, chi0, times_s, twists)


@jit
def _structures(s: FloatArray, twists: FloatArray) -> FloatArray:
    return structures(_Omega, s, twists)
