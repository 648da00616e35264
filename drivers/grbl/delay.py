"""How late commanded motion comes, measured in passing on the first motion from rest."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState

FloatArray = NDArray[np.float64]

_REST_M_S = 1e-3
_SLOWEST_M_S = 5e-3  # below it a step of the motors takes too long
_SAME_SPEED = 0.05  # relative: the commands are steady, and the motion is what was commanded
_LEAST_CHANGE = 0.5  # relative, since the first command
_START_S = 0.010  # the first command is not followed quite at once
_VALUES = 8
_GIVE_UP_S = 3.0  # a controller's clock and pauses of the stream add up
_RATE_OFF = 0.005  # of a controller's clock


@dataclass(frozen=True, slots=True)
class MeasuredDelay:
    """From a command to the motion it causes, with its standard deviation."""

    delay_s: float
    std_s: float


class DelayMeter:
    """Compares how far the tool was told to go with how far it went.

    From rest the first command is followed at once, because nothing waits before it, and fills
    the queue; each later change waits in it. So in steady motion the way behind is the delay
    times the change of speed since the first command, and a step from rest tells nothing.
    ``steady_s``, longer than the delay, is for how long the commands must have been the same;
    ``segment_s`` is the time from one look at the commands to the next. ``result`` comes once.
    """

    def __init__(self, steady_s: float, segment_s: float, stamp_std_s: float) -> None:
        self._steady_s = steady_s
        self._own_std_s = float(np.hypot(stamp_std_s, segment_s / np.sqrt(12.0)))
        self._newest: ArmState | None = None
        self.result: MeasuredDelay | None = None
        self.restart()

    def restart(self) -> None:
        """The motion is over, or no longer the commanded one: wait for the next from rest."""
        self._begun_s: float | None = None
        # Instants, tool velocities in base axes (3,), and the way told up to the instant (3,).
        self._told: deque[tuple[float, FloatArray, FloatArray]] = deque()
        self._values: list[float] = []

    def commanded(self, t_s: float, twist_tool: FloatArray) -> None:
        """A command that holds from ``t_s`` on."""
        state = self._newest
        if self.result is not None or state is None:
            return
        velocity = state.T_base_tool[:3, :3] @ twist_tool[:3]
        if self._begun_s is None:
            if not np.any(velocity) or np.linalg.norm(state.twist_tool[:3]) > _REST_M_S:
                return
            self._begun_s, self._first = t_s, velocity
            self._rest_m = state.T_base_tool[:3, 3].copy()
        told_m = self._told_m(t_s) if self._told else np.zeros(3)
        self._told.append((t_s, velocity, told_m))
        if t_s - self._begun_s > _GIVE_UP_S:
            self.restart()

    def measured(self, state: ArmState) -> None:
        """A state, later than those before."""
        self._newest = state
        if self.result is not None or self._begun_s is None or not self._told:
            return
        velocity = self._steady(state.t_s)
        if velocity is None:
            return
        speed = float(np.linalg.norm(velocity))
        ahead = velocity / speed
        change = speed - float(ahead @ self._first)
        if change < _LEAST_CHANGE * speed:
            return
        real = float(ahead @ state.T_base_tool[:3, :3] @ state.twist_tool[:3])
        if abs(real / speed - 1.0) > _SAME_SPEED:
            return
        behind_m = self._told_m(state.t_s) - (state.T_base_tool[:3, 3] - self._rest_m)
        self._values.append(float(ahead @ behind_m) / change)
        if len(self._values) == _VALUES:
            off_s = _RATE_OFF * (state.t_s - self._begun_s)
            own_s = math.hypot(self._own_std_s, off_s) * speed / change
            start_s = _START_S * (speed - change) / change
            std_s = math.hypot(float(np.std(self._values)), own_s, start_s)
            self.result = MeasuredDelay(float(np.mean(self._values)), std_s)

    def _told_m(self, t_s: float) -> FloatArray:
        """The way (3,) told up to an instant, at most one command back."""
        for begun_s, velocity, way_m in reversed(self._told):
            if begun_s <= t_s:
                return way_m + (t_s - begun_s) * velocity
        return np.zeros(3)

    def _steady(self, t_s: float) -> FloatArray | None:
        """The velocity told, the same for long enough before ``t_s``; None: it was not."""
        latest = [told for told in self._told if told[0] <= t_s]
        if not latest or t_s - latest[0][0] < self._steady_s:
            return None
        velocity = latest[-1][1]
        speed = float(np.linalg.norm(velocity))
        if speed < _SLOWEST_M_S:
            return None
        for begun_s, before, _ in reversed(latest):
            if np.linalg.norm(before - velocity) > _SAME_SPEED * speed:
                return None
            if begun_s <= t_s - self._steady_s:
                return velocity
        return None
