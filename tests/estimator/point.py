"""A point target, s = (x, y), χ = 1/Z: nonlinear in χ, χ̇ ≠ 0, Ω depending on s.

Here to hold the framework to its word that any (s, χ, Ω, f_m, f_u) will do.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.flow import follow, structures
from estimator.image.feature import Feature
from estimator.jit import jit, jit_template

FloatArray = NDArray[np.float64]


class Point:
    """ẋ = ..., the interaction matrix of an image point; χ̇ = v_z χ² + (y ω_x − x ω_y) χ."""

    @property
    def m(self) -> int:
        return 2

    @property
    def p(self) -> int:
        return 1

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        image: FloatArray = feature.s[:2] / feature.s[2]
        return image

    def position_and_axis(self, s: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        return np.append(s, 1.0), None

    def chi_of_guess(self, s: FloatArray, radius_m: float) -> FloatArray:
        return np.array([1.0 / radius_m])

    def inverse_radius(self, s: FloatArray, chi: FloatArray) -> float:
        return float(chi[0])

    def f_m(self, s: FloatArray, u: FloatArray) -> FloatArray:
        return _point_f_m(s, u)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        return _point_Omega(s, v)

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        return _point_f_u(s, chi, u)

    def flow(
        self, s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        return _point_flow(s0, chi0, times_s, twists)

    def structures(self, s: FloatArray, twists: FloatArray) -> FloatArray:
        return _point_structures(s, twists)


class TwoBalls:
    """Two balls seen at once, s = (s1, s2) packed by the caller, χ = (1/R1, 1/R2): p = 2."""

    @property
    def m(self) -> int:
        return 6

    @property
    def p(self) -> int:
        return 2

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        return np.array(feature.s)

    def position_and_axis(self, s: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        return s[:3], None

    def chi_of_guess(self, s: FloatArray, radius_m: float) -> FloatArray:
        return np.full(2, 1.0 / radius_m)

    def inverse_radius(self, s: FloatArray, chi: FloatArray) -> float:
        return float(chi[0])

    def f_m(self, s: FloatArray, u: FloatArray) -> FloatArray:
        return _balls_f_m(s, u)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        return _balls_Omega(s, v)

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        return _balls_f_u(s, chi, u)

    def flow(
        self, s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        return _balls_flow(s0, chi0, times_s, twists)

    def structures(self, s: FloatArray, twists: FloatArray) -> FloatArray:
        return _balls_structures(s, twists)


@jit_template
def _point_f_m(s: FloatArray, u: FloatArray) -> FloatArray:
    x, y, wx, wy, wz = s[0], s[1], u[3], u[4], u[5]
    x_dot = x * y * wx - (1.0 + x * x) * wy + y * wz
    y_dot = (1.0 + y * y) * wx - x * y * wy - x * wz
    return np.array([x_dot, y_dot])


@jit_template
def _point_Omega(s: FloatArray, v: FloatArray) -> FloatArray:
    return np.array([[s[0] * v[2] - v[0], s[1] * v[2] - v[1]]])


@jit_template
def _point_f_u(s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
    turn = s[1] * u[3] - s[0] * u[4]
    return np.array([u[2] * chi[0] * chi[0] + turn * chi[0]])


@jit
def _point_flow(
    s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
) -> tuple[FloatArray, FloatArray]:
    return follow(_point_f_m, _point_Omega, _point_f_u, s0, chi0, times_s, twists)


@jit
def _point_structures(s: FloatArray, twists: FloatArray) -> FloatArray:
    return structures(_point_Omega, s, twists)


@jit_template
def _balls_f_m(s: FloatArray, u: FloatArray) -> FloatArray:
    wx, wy, wz = u[3], u[4], u[5]
    first = [s[1] * wz - s[2] * wy, s[2] * wx - s[0] * wz, s[0] * wy - s[1] * wx]
    second = [s[4] * wz - s[5] * wy, s[5] * wx - s[3] * wz, s[3] * wy - s[4] * wx]
    return np.array(first + second)


@jit_template
def _balls_Omega(s: FloatArray, v: FloatArray) -> FloatArray:
    rows = np.zeros((2, 6))
    for j in range(3):
        rows[0, j] = -v[j]
        rows[1, 3 + j] = -2.0 * v[j]  # the second χ in units of half
    return rows


@jit_template
def _balls_f_u(s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
    return np.zeros(2)


@jit
def _balls_flow(
    s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
) -> tuple[FloatArray, FloatArray]:
    return follow(_balls_f_m, _balls_Omega, _balls_f_u, s0, chi0, times_s, twists)


@jit
def _balls_structures(s: FloatArray, twists: FloatArray) -> FloatArray:
    return structures(_balls_Omega, s, twists)
