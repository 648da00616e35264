"""What a target must say to be estimated: the terms of equation (1)."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.image.feature import Feature

FloatArray = NDArray[np.float64]


class Model(Protocol):
    """A system ṡ = f_m(s, u) + Ωᵀ(s, v) χ, χ̇ = f_u(s, χ, u), eq. (1).

    ``s`` (m,) is everything an image measures that the dynamics need: for the cylinder the
    paper's s followed by the axis a, whose rows of Ωᵀ are zero. ``chi`` (p,) is what no image
    shows. ``u`` = (v, ω) is the camera's twist in its own frame.

    The three terms are written once, as templates for compilation; ``flow`` and ``structures``
    apply them along a motion, compiled by two kernels that do nothing but hand the terms to the
    functions of ``estimator.flow``.
    """

    @property
    def m(self) -> int:
        """The number of measured quantities in s."""
        ...

    @property
    def p(self) -> int:
        """The number of unknowns in χ."""
        ...

    def measured(self, feature: Feature, near: FloatArray | None) -> FloatArray:
        """The measured s (m,) of a feature, free signs chosen so that it lies near ``near``."""
        ...

    def shown(self, s: FloatArray) -> FloatArray:
        """What ``Feature.s`` is at s (m,): what ``measured`` reads s from."""
        ...

    def position_and_axis(self, s: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """P0 / R (3,) and the axis (3,), if the target has one, out of s (m,).

        R is the length that χ is the inverse of, for points the depth or range of the first.
        """
        ...

    def chi_of_guess(self, s: FloatArray, radius_m: float) -> FloatArray:
        """χ (p,) of a target seen at s (m,) whose radius were ``radius_m``."""
        ...

    def inverse_radius(self, s: FloatArray, chi: FloatArray) -> float:
        """1/R in 1/m that belongs to s (m,) and χ (p,)."""
        ...

    def f_m(self, s: FloatArray, u: FloatArray) -> FloatArray:
        """The part of ṡ (m,) that does not depend on χ."""
        ...

    def Omega(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Ω (p, m), linear in the camera's linear velocity v (3,)."""
        ...

    def f_u(self, s: FloatArray, chi: FloatArray, u: FloatArray) -> FloatArray:
        """χ̇ (p,)."""
        ...

    def flow(
        self, s0: FloatArray, chi0: FloatArray, times_s: FloatArray, twists: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(1) integrated: s (b, n, m) and χ (b, n, p) at ``times_s`` (n,), twists (n, 6) between.

        From b starts s0 (b, m), χ0 (b, p). Where the twist is too fast to be followed, and from
        there on, the result is NaN.
        """
        ...

    def structures(self, s: FloatArray, twists: FloatArray) -> FloatArray:
        """Ω (n, p, m) at n states s (n, m) and twists (n, 6)."""
        ...
