"""The cylinder, equation (20), its measured axis a part of the state: s = (P0 / R, a)."""

import numpy as np
from numpy.typing import NDArray

from estimator.flow import follow, structures
from estimator.image.feature import Feature
from estimator.jit import jit, jit_template

FloatArray = NDArray[np.float64]


class Cylinder:
    """ṡ = [s]× ω + (a aᵀ − I) v χ, ȧ = [a]× ω, χ̇ = 0 (20); P0 is the axis point nearest to the
    camera and χ = 1/R.

    The state is (s, a) (6,), so Ωᵀ is (a aᵀ − I) v above three zeros.
    """

    @property
    def m(self) -> int:
        """Six: P0 in radii and the axis."""
        return 6

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

    def shown(self, s: FloatArray) -> FloatArray:
        """The half of s (6,) that is P0 / R (3,)."""
        return s[:3]

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
        """([s]× ω, [a]× ω) (6,)."""
        return _f_m(s, u)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """(vᵀ (a aᵀ − I), 0) (1, 6)."""
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
    s_dot = [s[1] * wz - s[2] * wy, s[2] * wx - s[0] * wz, s[0] * wy - s[1] * wx]
    a_dot = [s[4] * wz - s[5] * wy, s[5] * wx - s[3] * wz, s[3] * wy - s[4] * wx]
    return np.array(s_dot + a_dot)


@jit_template
def _Omega(s: FloatArray, v: FloatArray) -> FloatArray:
    ax, ay, az = s[3], s[4], s[5]
    along = ax * v[0] + ay * v[1] + az * v[2]
    return np.array([[ax * along - v[0], ay * along - v[1], az * along - v[2], 0.0, 0.0, 0.0]])


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
