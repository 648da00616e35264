"""The sphere by its limb plane, equation (7), for comparison: three unknowns in place of one.

s = (x_g, y_g, n20, n11, n02), the barycentre of the outline and its centred moments of second
order over the area; χ = P0 / K, K = P0ᵀP0 − R², with 1/Z = χᵀ (x, y, 1) on the plane.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.flow import follow, structures
from estimator.image.feature import Feature
from estimator.jit import jit, jit_template

FloatArray = NDArray[np.float64]


class LimbPlane:
    """The moments' dynamics, linear in χ (their interaction matrix for a plane), and that of χ.

    The outline of a sphere is an ellipse, whose centred moments of third order are zero; so the
    moments of s are all that their own rates need.
    """

    @property
    def m(self) -> int:
        """Five moments."""
        return 5

    @property
    def p(self) -> int:
        """Three: the plane."""
        return 3

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        """The moments (5,) of the outline of a sphere at the feature's s; see ``moments_of``."""
        if feature.axis is not None:
            raise ValueError("the limb plane is that of a sphere: a cylinder has another")
        return moments_of(feature.s)

    def shown(self, s: FloatArray) -> FloatArray:
        """P0 / R (3,) of the moments (5,)."""
        return self.position_and_axis(s)[0]

    def position_and_axis(self, s: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """P0 / R (3,) by (10) and (11), the printed n11 squared; and no axis."""
        n20, n11, n02 = s[2], s[3], s[4]
        a1_2 = 2.0 * (n20 + n02 - np.sqrt((n20 - n02) ** 2 + 4.0 * n11 * n11))
        s_z = np.sqrt((1.0 + a1_2) / a1_2)
        return np.array([s[0] / (s_z * a1_2), s[1] / (s_z * a1_2), s_z]), None

    def chi_of_guess(self, s: FloatArray, radius_m: float) -> FloatArray:
        """P0 / K (3,) if the radius were ``radius_m``."""
        position, _ = self.position_and_axis(s)
        chi: FloatArray = position / (radius_m * (float(position @ position) - 1.0))
        return chi

    def inverse_radius(self, s: FloatArray, chi: FloatArray) -> float:
        """1/R = χᵀs (‖s‖² − 1) / ‖s‖², with s = P0 / R."""
        position, _ = self.position_and_axis(s)
        square = float(position @ position)
        return float(chi @ position) * (square - 1.0) / square

    def f_m(self, s: FloatArray, u: FloatArray) -> FloatArray:
        """The moments' rates (5,) due to ω."""
        return _f_m(s, u)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """(3, 5)."""
        return _Omega(s, v)

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        """χ̇ (3,): both P0 and K change."""
        return _f_u(s, chi, u)

    def flow(
        self, s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """See ``Model.flow``."""
        return _flow(s0, chi0, times_s, twists)

    def structures(self, s: FloatArray, twists: FloatArray) -> FloatArray:
        """See ``Model.structures``."""
        return _structures(s, twists)


def moments_of(s: FloatArray) -> FloatArray:
    """The moments (5,) of the outline of a sphere at s = P0 / R (3,), exactly.

    Its rays p fulfil pᵀ (s sᵀ − (sᵀs − 1) I) p = 0; the ellipse's second moments over its area
    are a quarter of its squared semi-axes. Raises ValueError where the outline is no ellipse.
    """
    if not s[2] > 1.0:
        raise ValueError("the sphere reaches behind the camera: its outline is no ellipse")
    Q = np.outer(s, s) - (float(s @ s) - 1.0) * np.eye(3)
    centre = -np.linalg.solve(Q[:2, :2], Q[:2, 2])
    shape = -(Q[2, 2] + Q[:2, 2] @ centre) * np.linalg.inv(Q[:2, :2])
    return np.array([*centre, *(0.25 * shape[[0, 0, 1], [0, 1, 1]])])


@jit_template
def _raw(s: FloatArray) -> FloatArray:
    """Moments about the origin over the area, M[i, j] of x^i y^j up to order three (4, 4)."""
    x, y, n20, n11, n02 = s[0], s[1], s[2], s[3], s[4]
    M = np.zeros((4, 4))
    M[0, 0], M[1, 0], M[0, 1] = 1.0, x, y
    M[2, 0], M[1, 1], M[0, 2] = n20 + x * x, n11 + x * y, n02 + y * y
    M[3, 0], M[0, 3] = x * (x * x + 3.0 * n20), y * (y * y + 3.0 * n02)
    M[2, 1] = x * x * y + n20 * y + 2.0 * n11 * x
    M[1, 2] = x * y * y + n02 * x + 2.0 * n11 * y
    return M


@jit_template
def _centred(s: FloatArray, rates: FloatArray) -> FloatArray:
    """The rates of s (5,) from those of the raw moments 00, 10, 01, 20, 11, 02 (6,)."""
    x, y = s[0], s[1]
    M = _raw(s)
    grows = rates[0]
    x_dot, y_dot = rates[1] - x * grows, rates[2] - y * grows
    return np.array(
        [
            x_dot,
            y_dot,
            rates[3] - M[2, 0] * grows - 2.0 * x * x_dot,
            rates[4] - M[1, 1] * grows - x * y_dot - y * x_dot,
            rates[5] - M[0, 2] * grows - 2.0 * y * y_dot,
        ]
    )


@jit_template
def _below(M: FloatArray, i: int, j: int) -> float:
    """M[i, j], and zero where an index is negative."""
    return float(M[i, j]) if i >= 0 and j >= 0 else 0.0


@jit_template
def _f_m(s: FloatArray, u: FloatArray) -> FloatArray:
    M, rates = _raw(s), np.zeros(6)
    orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    for k in range(6):
        i, j = orders[k]
        rates[k] = u[3] * ((i + j + 3) * M[i, j + 1] + j * _below(M, i, j - 1))
        rates[k] -= u[4] * ((i + j + 3) * M[i + 1, j] + i * _below(M, i - 1, j))
        if i > 0:
            rates[k] += u[5] * i * M[i - 1, j + 1]
        if j > 0:
            rates[k] -= u[5] * j * M[i + 1, j - 1]
    return _centred(s, rates)


@jit_template
def _Omega(s: FloatArray, v: FloatArray) -> FloatArray:
    M, out = _raw(s), np.empty((3, 5))
    orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    for unknown in range(3):
        # M times x, y or 1: what the plane's A, B and C weigh the moments by.
        up, right = 1 if unknown == 0 else 0, 1 if unknown == 1 else 0
        rates = np.zeros(6)
        for k in range(6):
            i, j = orders[k]
            if i > 0:
                rates[k] -= v[0] * i * M[i - 1 + up, j + right]
            if j > 0:
                rates[k] -= v[1] * j * M[i + up, j - 1 + right]
            rates[k] += v[2] * (i + j + 3) * M[i + up, j + right]
            rates[k] -= v[unknown] * M[i, j]
        out[unknown] = _centred(s, rates)
    return out


@jit_template
def _f_u(s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
    n20, n11, n02 = s[2], s[3], s[4]
    a1_2 = 2.0 * (n20 + n02 - np.sqrt((n20 - n02) ** 2 + 4.0 * n11 * n11))
    s_z = np.sqrt((1.0 + a1_2) / a1_2)
    square = (s[0] * s[0] + s[1] * s[1]) / (s_z * s_z * a1_2 * a1_2) + s_z * s_z
    inverse_K = (chi[0] ** 2 + chi[1] ** 2 + chi[2] ** 2) * (square - 1.0) / square
    along = 2.0 * (chi[0] * u[0] + chi[1] * u[1] + chi[2] * u[2])
    wx, wy, wz = u[3], u[4], u[5]
    return np.array(
        [
            along * chi[0] - inverse_K * u[0] + chi[1] * wz - chi[2] * wy,
            along * chi[1] - inverse_K * u[1] + chi[2] * wx - chi[0] * wz,
            along * chi[2] - inverse_K * u[2] + chi[0] * wy - chi[1] * wx,
        ]
    )


@jit
def _flow(
    s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
) -> tuple[FloatArray, FloatArray]:
    return follow(_f_m, _Omega, _f_u, s0, chi0, times_s, twists)


@jit
def _structures(s: FloatArray, twists: FloatArray) -> FloatArray:
    return structures(_Omega, s, twists)
