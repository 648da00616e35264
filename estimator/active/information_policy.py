"""The velocity that makes the radius known soonest, as the images' own noise has it."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimator.active.information import (
    directions_across,
    displacements,
    sphere_directions,
    variance_decrease,
)
from estimator.active.room import BRAKING_SHARE, BoolArray, Walls, room_for
from estimator.estimate import Estimate

FloatArray = NDArray[np.float64]

_DIRECTIONS = 60
_HORIZON_S = 0.5
# Another direction has to leave less than this share of the variance that going on leaves.
_WORTH_TURNING = 0.7
_TURN_RAD_S = 3.0
# Directions that leave no more than so many times the least variance are as good as the best.
_AS_GOOD = 1.05
# How little the turn and the direction of before count in choosing among them.
_TURNING_LESS, _LIKENESS = 0.1, 0.01


class InformationPolicy:
    """v of constant norm, in the direction after which var(χ) is least half a second later.

    The candidates are directions all around. Those are left out that would bring the camera
    closer to the target's surface than ``least_distance_m`` or farther than
    ``most_distance_m``, or past one of ``walls()``. The first choice is free, and takes the
    easiest of those as good as the best; later ones turn v at a bounded rate and have to be
    worth it. Without a covariance v stays ``v0`` (3,).
    Raises ValueError for a v0 that is zero.
    """

    def __init__(
        self,
        v0: ArrayLike,
        least_distance_m: float,
        most_distance_m: float = math.inf,
        walls: Callable[[], Walls | None] = lambda: None,
    ) -> None:
        self._v = np.array(v0, dtype=float)
        self._speed_m_s = float(np.linalg.norm(self._v))
        if self._v.shape != (3,) or not 0.0 < self._speed_m_s < math.inf:
            raise ValueError(f"InformationPolicy needs a velocity v0 that is not zero, not {v0!r}")
        self._least_m = least_distance_m
        self._most_m = most_distance_m
        self._walls = walls
        self._directions = sphere_directions(_DIRECTIONS)
        self._wanted = self._v / self._speed_m_s
        self._chosen = False

    @property
    def v(self) -> FloatArray:
        """The velocity (3,) wanted now, in m/s."""
        return self._v.copy()

    def inform(self, estimate: Estimate) -> None:
        """Choose anew where to go, with what is known now."""
        if estimate.covariance is None or estimate.image_covariance is None:
            return
        # Going on as now is the first candidate.
        going = (self._wanted if self._chosen else self._v / self._speed_m_s)[None]
        directions = np.concatenate(
            (going, self._directions, directions_across(estimate.s, estimate.axis))
        )
        way_m = self._speed_m_s * _HORIZON_S
        left = float(estimate.covariance[3, 3]) - variance_decrease(
            estimate.covariance,
            estimate.image_covariance,
            displacements(directions, way_m, estimate.axis),
        )
        left = np.where(self._free(directions, way_m, estimate), left, math.inf)
        best = int(np.argmin(left))
        if not math.isfinite(left[best]):
            return  # nowhere to go: what limits the motion decides
        if not self._chosen:
            hardness = _hardness(directions, estimate.s, going[0])
            good = left <= _AS_GOOD * left[best]
            self._wanted = directions[int(np.argmin(np.where(good, hardness, math.inf)))]
            self._v, self._chosen = self._speed_m_s * self._wanted, True
        elif left[best] < _WORTH_TURNING * left[0]:
            self._wanted = directions[best]

    def advance(self, axis: FloatArray | None, omega: FloatArray, dt_s: float) -> None:
        """Turn v towards the chosen direction for ``dt_s``."""
        now = self._v / self._speed_m_s
        angle = math.acos(min(max(float(now @ self._wanted), -1.0), 1.0))
        step = _TURN_RAD_S * dt_s
        if angle <= step:
            self._v = self._speed_m_s * self._wanted
            return
        aside = self._wanted - float(now @ self._wanted) * now
        norm = float(np.linalg.norm(aside))
        if norm < 1e-9:  # straight back: by any way round
            aside = np.cross(now, np.eye(3)[int(np.argmin(np.abs(now)))])
            norm = float(np.linalg.norm(aside))
        self._v = self._speed_m_s * (math.cos(step) * now + math.sin(step) * aside / norm)

    def _free(self, directions: FloatArray, way_m: float, estimate: Estimate) -> BoolArray:
        """Which of the directions (n, 3) leave room for the way and for braking."""
        free = room_for(directions, way_m, self._walls())
        if estimate.chi > 0.0:
            target_m = estimate.s / estimate.chi
            shifts = displacements(directions, way_m * (1.0 + BRAKING_SHARE), estimate.axis)
            now_m = float(np.linalg.norm(target_m)) - 1.0 / estimate.chi
            then_m = np.linalg.norm(target_m - shifts, axis=1) - 1.0 / estimate.chi
            # Where the camera already is beyond a bound, the way back is free.
            free &= (then_m >= self._least_m) | (then_m > now_m)
            free &= (then_m <= self._most_m) | (then_m < now_m)
        return free


def _hardness(directions: FloatArray, s: FloatArray, going: FloatArray) -> FloatArray:
    """What speaks against each of the directions (n, 3) while the target at s is being centred.

    As long as the image moves along s_x, s_y an image's uncertain instant makes it uncertain
    that way: across it tells more. Where that cannot be, rather towards the target's place than
    away from it: the camera turns less, which leaves more of the arm's acceleration for v. Of
    two that are alike the one nearer to ``going`` (3,) is taken.
    """
    towards = directions[:, :2] @ s[:2]
    likeness = math.hypot(s[0], s[1]) * (directions @ going)
    hardness: FloatArray = np.abs(towards) - _TURNING_LESS * towards - _LIKENESS * likeness
    return hardness
