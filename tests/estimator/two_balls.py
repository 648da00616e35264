"""Two balls seen at once, their unknowns mixed: p = 2 with an Ω Ωᵀ that is not diagonal.

Ω Ωᵀ = ‖v‖² Aᵀ A, so its eigenvectors stay while its eigenvalues change: the one kind of target
with p > 1 whose errors obey (5) exactly, each in its own coordinate, whatever the motion.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.flow import follow, structures
from estimator.image.feature import Feature
from estimator.jit import jit, jit_template

FloatArray = NDArray[np.float64]

A = np.array([[1.0, 0.5], [-0.3, 2.0]])  # (1/R1, 1/R2) = A χ


class TwoBalls:
    """s = (s1, s2), both balls' P0 / R."""

    @property
    def m(self) -> int:
        return 6

    @property
    def p(self) -> int:
        return 2

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        return np.array(feature.s)

    def shown(self, s: FloatArray) -> FloatArray:
        return s

    def position_and_axis(self, s: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        return s[:3], None

    def chi_of_guess(self, s: FloatArray, radius_m: float) -> FloatArray:
        return np.linalg.solve(A, np.full(2, 1.0 / radius_m))

    def inverse_radius(self, s: FloatArray, chi: FloatArray) -> float:
        return float(A[0] @ chi)

    def f_m(self, s: FloatArray, u: FloatArray) -> FloatArray:
        return _f_m(s, u)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        return _Omega(s, v)

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        return _f_u(s, chi, u)

    def flow(
        self, s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        return _flow(s0, chi0, times_s, twists)

    def structures(self, s: FloatArray, twists: FloatArray) -> FloatArray:
        return _structures(s, twists)


@jit_template
def _f_m(s: FloatArray, u: FloatArray) -> FloatArray:
    wx, wy, wz = u[3], u[4], u[5]
    first = [s[1] * wz - s[2] * wy, s[2] * wx - s[0] * wz, s[0] * wy - s[1] * wx]
    second = [s[4] * wz - s[5] * wy, s[5] * wx - s[3] * wz, s[3] * wy - s[4] * wx]
    return np.array(first + second)


@jit_template
def _Omega(s: FloatArray, v: FloatArray) -> FloatArray:
    rows = np.empty((2, 6))
    for i in range(2):
        for j in range(3):
            rows[i, j] = -A[0, i] * v[j]
            rows[i, 3 + j] = -A[1, i] * v[j]
    return rows


@jit_template
def _f_u(s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
    return np.zeros(2)


@jit
def _flow(
    s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
) -> tuple[FloatArray, FloatArray]:
    return follow(_f_m, _Omega, _f_u, s0, chi0, times_s, twists)


@jit
def _structures(s: FloatArray, twists: FloatArray) -> FloatArray:
    return structures(_Omega, s, twists)
