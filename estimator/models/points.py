"""Points in a planar image: s = (x, y) of each, χ = 1/Z of each; p = 1 for one point."""

import numpy as np
from numpy.typing import NDArray

from estimator.flow import follow, structures
from estimator.image.feature import Feature
from estimator.jit import jit, jit_template

FloatArray = NDArray[np.float64]


class Points:
    """ẋ = x y ω_x − (1 + x²) ω_y + y ω_z + (x v_z − v_x) χ and likewise ẏ, for each of n points.

    χ̇ = v_z χ² + (y ω_x − x ω_y) χ: not linear, so (5) holds only up to what the last term of (3)
    adds. Each point has its own two columns in Ω (n, 2n), hence σ_i² = (x_i v_z − v_x)² +
    (y_i v_z − v_y)², at most (1 + x_i² + y_i²) ‖v‖² (journal version of the paper, T-RO 2014).
    A ``Feature`` of points holds s itself; the length it is measured in is a point's depth, so
    a "radius" of this model is the depth of the first point.
    Raises ValueError for no point.
    """

    def __init__(self, count: int = 1) -> None:
        if count < 1:
            raise ValueError(f"a model needs one point or more, not {count}")
        self._count = count

    @property
    def m(self) -> int:
        """Two for each point."""
        return 2 * self._count

    @property
    def p(self) -> int:
        """One for each point."""
        return self._count

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        """The feature's s (2n,); ValueError for another number of points."""
        return points_of(feature, self._count)

    def shown(self, s: FloatArray) -> FloatArray:
        """s (2n,) itself."""
        return s

    def position_and_axis(self, s: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """The first point in its own depths, (x, y, 1); and no axis."""
        return np.array([s[0], s[1], 1.0]), None

    def chi_of_guess(self, s: FloatArray, radius_m: float) -> FloatArray:
        """1/Z (n,) if all depths were ``radius_m``."""
        return np.full(self._count, 1.0 / radius_m)

    def inverse_radius(self, s: FloatArray, chi: FloatArray) -> float:
        """1/Z of the first point."""
        return float(chi[0])

    def f_m(self, s: FloatArray, u: FloatArray) -> FloatArray:
        """The part of ṡ (2n,) due to ω."""
        return _f_m(s, u)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """(n, 2n), two columns for each point."""
        return _Omega(s, v)

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        """χ̇ (n,): depths change."""
        return _f_u(s, chi, u)

    def flow(
        self, s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """See ``Model.flow``."""
        return _flow(s0, chi0, times_s, twists)

    def structures(self, s: FloatArray, twists: FloatArray) -> FloatArray:
        """See ``Model.structures``."""
        return _structures(s, twists)


def points_of(feature: Feature, count: int) -> FloatArray:
    """The image points (2n,) of a feature; ValueError unless they are ``count``."""
    s = np.array(feature.s, dtype=float)
    if feature.axis is not None or s.shape != (2 * count,):
        raise ValueError(
            f"a feature of {count} points holds {2 * count} image coordinates and no axis, "
            f"not s of shape {s.shape}"
        )
    return s


@jit_template
def _f_m(s: FloatArray, u: FloatArray) -> FloatArray:
    rates = np.empty(s.size)
    for i in range(0, s.size, 2):
        x, y = s[i], s[i + 1]
        rates[i] = x * y * u[3] - (1.0 + x * x) * u[4] + y * u[5]
        rates[i + 1] = (1.0 + y * y) * u[3] - x * y * u[4] - x * u[5]
    return rates


@jit_template
def _Omega(s: FloatArray, v: FloatArray) -> FloatArray:
    rows = np.zeros((s.size // 2, s.size))
    for i in range(s.size // 2):
        rows[i, 2 * i] = s[2 * i] * v[2] - v[0]
        rows[i, 2 * i + 1] = s[2 * i + 1] * v[2] - v[1]
    return rows


@jit_template
def _f_u(s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
    rates = np.empty(chi.size)
    for i in range(chi.size):
        turn = s[2 * i + 1] * u[3] - s[2 * i] * u[4]
        rates[i] = (u[2] * chi[i] + turn) * chi[i]
    return rates


@jit
def _flow(
    s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
) -> tuple[FloatArray, FloatArray]:
    return follow(_f_m, _Omega, _f_u, s0, chi0, times_s, twists)


@jit
def _structures(s: FloatArray, twists: FloatArray) -> FloatArray:
    return structures(_Omega, s, twists)
