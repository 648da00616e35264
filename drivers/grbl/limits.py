"""Joint ranges and axis speeds: how far a motion has to be scaled down to respect them."""

import math

import numpy as np
from numpy.typing import NDArray

from drivers.grbl.controller import Controller
from drivers.grbl.settings import AxisSettings

FloatArray = NDArray[np.float64]

# Near the end of a range the speed falls with the distance left over this time, which must
# be longer than any block.
_APPROACH_S = 0.15
_BLOCKED_BELOW = 0.02
_ROUNDING = 1e-9  # of the fastest axis: no motion


class AxisLimits:
    """The configured ranges in machine coordinates and the controller's speeds."""

    def __init__(self, axes: tuple[AxisSettings, ...], controller: Controller) -> None:
        self._names = [f"{axis.letter} ({axis.joint})" for axis in axes]
        low = [-math.inf if axis.mpos_min is None else axis.mpos_min for axis in axes]
        high = [math.inf if axis.mpos_max is None else axis.mpos_max for axis in axes]
        self.low, self.high = np.array(low), np.array(high)  # (n,) machine coordinates
        self._max_rate = controller.max_rate
        self._acceleration = controller.acceleration

    def scale(self, position: FloatArray, rates: FloatArray) -> float:
        """The factor in [0, 1] for all axes that keeps every one within speed and range.

        One factor keeps the direction of the motion; at the end of a range it is zero.
        """
        speed = np.maximum(np.abs(rates), 1e-12)
        left = np.maximum(self._left(position, rates), 0.0)
        # Half the acceleration: the other half is needed where axes share the motion.
        stoppable = np.sqrt(self._acceleration * left)
        allowed = np.minimum(np.minimum(stoppable, left / _APPROACH_S), self._max_rate)
        return float(min(1.0, np.min(allowed / speed)))

    def blocked_by(self, position: FloatArray, rates: FloatArray) -> str | None:
        """The axis at the end of its range that the motion would push further, if any."""
        if not np.any(rates) or self.scale(position, rates) >= _BLOCKED_BELOW:
            return None
        left = self._left(position, rates)
        axis = int(np.argmin(left / np.maximum(np.abs(rates), 1e-12)))
        if left[axis] > _APPROACH_S * self._max_rate[axis]:
            return None  # slow for its speed alone
        end = self.high[axis] if rates[axis] > 0.0 else self.low[axis]
        return f"{self._names[axis]} is at the end of its range, {end:g} in machine coordinates"

    def _left(self, position: FloatArray, rates: FloatArray) -> FloatArray:
        # Rounding in the kinematics gives every axis a hair of motion: an axis that stands on its
        # end after homing must not keep the others from moving.
        hair = _ROUNDING * float(np.max(np.abs(rates), initial=0.0))
        left: FloatArray = np.where(
            rates > hair,
            self.high - position,
            np.where(rates < -hair, position - self.low, math.inf),
        )
        return left
