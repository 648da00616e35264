"""What measuring an image would have found: s and the axis, exact but for noise as images have it.

An outline shows where its middle is and how large it is about equally well, in pixels. In
s = P0 / R the size is the length of s: its error is larger than that across by about ‖s‖.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sim_backend.config import FeatureConfig
from sim_backend.lens import Lens
from sim_backend.truth import Truth

FloatArray = NDArray[np.float64]

# Of an outline's half-size, which is 1: that of the middle of a circle, and what the two sides
# of a cylinder share; the turn of those in rad, for 1 rad. As found with rendered pixels.
_CIRCLE_MIDDLE, _SIDES, _SIDES_TURN = math.sqrt(2.0), math.sqrt(0.5), 4.0 * math.sqrt(0.5)


@dataclass(frozen=True, slots=True)
class SeenFeature:
    """One image's result."""

    s: FloatArray  # (3,)
    covariance: FloatArray  # (3, 3) of s
    axis: FloatArray | None  # (3,)


class FeatureSource:
    """Looks at the truth through a noisy camera; the same seed and frame give the same noise."""

    def __init__(self, config: FeatureConfig, truth: Truth, lens: Lens, seed: int) -> None:
        self._config = config
        self._truth = truth
        self._lens = lens
        self._seed = seed

    def seen(self, t_s: float, seq: int) -> SeenFeature | str:
        """What frame ``seq``, exposed at ``t_s``, shows, or why it shows nothing."""
        random = np.random.default_rng([self._seed, 4, seq])
        lost, outlier = random.random(2)
        s, axis = self._truth.s(t_s), self._truth.axis(t_s)
        if lost < self._config.lost_probability:
            return "no outline found"
        if not self._in_view(s):
            return "the target is out of view"
        angle = self._config.noise_px / self._lens.focal_px
        draw = random.standard_normal(5)
        if outlier < self._config.outlier_probability:
            draw = draw * self._config.outlier_size
        if axis is None:
            return _sphere(s, angle, draw)
        return _cylinder(s, axis, angle, draw)

    def _in_view(self, s: FloatArray) -> bool:
        """Whether the target's middle is inside the image."""
        if not s[2] > 1.0:
            return False
        u, v = self._lens.project(s[None])[0]
        return bool(0.0 <= u <= self._lens.width - 1 and 0.0 <= v <= self._lens.height - 1)


def _sphere(s: FloatArray, angle: float, draw: FloatArray) -> SeenFeature:
    """``angle``: standard deviation of the outline's half-angle, in rad."""
    norm = float(np.linalg.norm(s))
    towards = s / norm
    aside, below = _across(towards)
    size, middle = _size_std(norm, angle), _CIRCLE_MIDDLE * angle * norm
    out = s + size * draw[0] * towards + middle * (draw[1] * aside + draw[2] * below)
    along = np.outer(towards, towards)
    return SeenFeature(out, size**2 * along + middle**2 * (np.eye(3) - along), None)


def _cylinder(s: FloatArray, axis: FloatArray, angle: float, draw: FloatArray) -> SeenFeature:
    """The two sides are straight: turned in the image, or against each other, the axis tilts."""
    norm = float(np.linalg.norm(s))
    towards = s / norm
    aside = np.cross(axis, towards)
    size, middle = _size_std(norm, _SIDES * angle), _SIDES * angle
    turn = _SIDES_TURN * angle
    tilt = turn * math.sqrt(norm * norm - 1.0)  # over the tangent of the half-angle
    rotation = Rotation.from_rotvec(
        middle * draw[1] * axis + tilt * draw[2] * aside + turn * draw[3] * towards
    )
    out = rotation.apply(s * (1.0 + size / norm * draw[0]))
    covariance = (
        size**2 * np.outer(towards, towards)
        + (norm * middle) ** 2 * np.outer(aside, aside)
        + (norm * tilt) ** 2 * np.outer(axis, axis)
    )
    return SeenFeature(out, covariance, rotation.apply(axis))


def _size_std(norm: float, angle: float) -> float:
    """Of ‖s‖ = 1 / sin θ, for a half-angle θ with this standard deviation."""
    return angle * norm * math.sqrt(norm * norm - 1.0)


def _across(n: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors across n and each other."""
    first = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    first /= np.linalg.norm(first)
    return first, np.cross(n, first)
