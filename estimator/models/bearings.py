"""Points on a spherical image: s = P/‖P‖ of each, χ = 1/‖P‖ of each; p = 1 for one point."""

import numpy as np
from numpy.typing import NDArray

from estimator.flow import follow, structures
from estimator.image.feature import Feature
from estimator.jit import jit, jit_template
from estimator.models.points import points_of

FloatArray = NDArray[np.float64]


class Bearings:
    """ḃ = [b]× ω + (b bᵀ − I) v χ, χ̇ = bᵀv χ², for each of n points at bearing b and range 1/χ.

    The same points as ``Points``, read from the same ``Feature``, but σ_i² = ‖v‖² − (b_iᵀv)²,
    whose largest value ‖v‖² is the same wherever in the image a point is (journal version of
    the paper, T-RO 2014). χ̇ does not depend on ω. A "radius" of this model is the range of the
    first point. Raises ValueError for no point.
    """

    def __init__(self, count: int = 1) -> None:
        if count < 1:
            raise ValueError(f"a model needs one point or more, not {count}")
        self._count = count

    @property
    def m(self) -> int:
        """Three for each point."""
        return 3 * self._count

    @property
    def p(self) -> int:
        """One for each point."""
        return self._count

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        """The unit bearings (3n,) of the image points (2n,) that the feature holds."""
        rays = np.ones((self._count, 3))
        rays[:, :2] = points_of(feature, self._count).reshape(-1, 2)
        bearings: FloatArray = (rays / np.linalg.norm(rays, axis=1, keepdims=True)).ravel()
        return bearings

    def shown(self, s: FloatArray) -> FloatArray:
        """The image points (2n,) at bearings (3n,)."""
        rays = s.reshape(-1, 3)
        points: FloatArray = (rays[:, :2] / rays[:, 2:]).ravel()
        return points

    def position_and_axis(self, s: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """The first point in its own ranges, its bearing (3,); and no axis."""
        bearing: FloatArray = s[:3] / np.linalg.norm(s[:3])
        return bearing, None

    def chi_of_guess(self, s: FloatArray, radius_m: float) -> FloatArray:
        """1/‖P‖ (n,) if all ranges were ``radius_m``."""
        return np.full(self._count, 1.0 / radius_m)

    def inverse_radius(self, s: FloatArray, chi: FloatArray) -> float:
        """1/‖P‖ of the first point."""
        return float(chi[0])

    def f_m(self, s: FloatArray, u: FloatArray) -> FloatArray:
        """[b]× ω of each point (3n,)."""
        return _f_m(s, u)

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """(n, 3n), three columns for each point."""
        return _Omega(s, v)

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        """χ̇ (n,): ranges change."""
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
    rates = np.empty(s.size)
    for i in range(0, s.size, 3):
        rates[i] = s[i + 1] * u[5] - s[i + 2] * u[4]
        rates[i + 1] = s[i + 2] * u[3] - s[i] * u[5]
        rates[i + 2] = s[i] * u[4] - s[i + 1] * u[3]
    return rates


@jit_template
def _Omega(s: FloatArray, v: FloatArray) -> FloatArray:
    rows = np.zeros((s.size // 3, s.size))
    for i in range(s.size // 3):
        along = s[3 * i] * v[0] + s[3 * i + 1] * v[1] + s[3 * i + 2] * v[2]
        for j in range(3):
            rows[i, 3 * i + j] = s[3 * i + j] * along - v[j]
    return rows


@jit_template
def _f_u(s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
    rates = np.empty(chi.size)
    for i in range(chi.size):
        along = s[3 * i] * u[0] + s[3 * i + 1] * u[1] + s[3 * i + 2] * u[2]
        rates[i] = along * chi[i] * chi[i]
    return rates


@jit
def _flow(
    s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
) -> tuple[FloatArray, FloatArray]:
    return follow(_f_m, _Omega, _f_u, s0, chi0, times_s, twists)


@jit
def _structures(s: FloatArray, twists: FloatArray) -> FloatArray:
    return structures(_Omega, s, twists)
