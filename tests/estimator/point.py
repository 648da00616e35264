"""A point target, s = (x, y), χ = 1/Z: nonlinear in χ, χ̇ ≠ 0, Ω depending on s.

Here to hold the framework to its word that any (s, χ, Ω, f_m, f_u) will do.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.image.feature import Feature

FloatArray = NDArray[np.float64]


class Point:
    """ẋ = ..., the interaction matrix of an image point; χ̇ = v_z χ² + (y ω_x − x ω_y) χ."""

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
        x, y = s[..., 0], s[..., 1]
        wx, wy, wz = u[..., 3], u[..., 4], u[..., 5]
        x_dot = x * y * wx - (1.0 + x * x) * wy + y * wz
        y_dot = (1.0 + y * y) * wx - x * y * wy - x * wz
        return np.stack((x_dot, y_dot), axis=-1)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        x, y = s[..., 0], s[..., 1]
        row = np.stack((x * v[..., 2] - v[..., 0], y * v[..., 2] - v[..., 1]), axis=-1)
        return row[..., None, :]

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        turn = s[..., 1] * u[..., 3] - s[..., 0] * u[..., 4]
        return u[..., 2, None] * chi * chi + turn[..., None] * chi


class TwoBalls:
    """Two balls seen at once, s = (s1, s2) packed by the caller, χ = (1/R1, 1/R2): p = 2."""

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
        omega = u[..., 3:]
        return np.concatenate((np.cross(s[..., :3], omega), np.cross(s[..., 3:], omega)), axis=-1)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        rows = np.zeros((*v.shape[:-1], 2, 6))
        rows[..., 0, :3] = -v
        rows[..., 1, 3:] = -2.0 * v  # the second χ in units of half
        return rows

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        return np.zeros_like(chi)
