"""From reported positions to measured motion: a straight line through the last reports."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from drivers.grbl.kinematics import GantryKinematics
from drivers.interfaces import ArmState

FloatArray = NDArray[np.float64]

# Two reports closer than this say nothing about speed.
_SHORTEST_S = 0.010
_LONGEST_GAP_S = 0.5


class MotionMeter:
    """Turns machine positions and their instants into arm states.

    The controller reports no velocity (its FS leads the motion), so velocity is the slope of
    the positions over a window. A slope is the mean over its window: the state belongs to
    the window's middle, pose and twist alike, and is therefore half a window old when born.
    """

    def __init__(self, kinematics: GantryKinematics, window_s: float) -> None:
        self._kinematics = kinematics
        self._window_s = window_s
        self._samples: deque[tuple[float, FloatArray]] = deque()
        self._last_s = float("-inf")

    @property
    def newest(self) -> tuple[float, FloatArray] | None:
        """The last report: its instant and machine position (n,)."""
        return self._samples[-1] if self._samples else None

    def add(self, t_s: float, mpos: FloatArray) -> ArmState | None:
        """Take a report; returns the state at the middle of the window that it completes."""
        samples = self._samples
        if samples and t_s - samples[-1][0] > _LONGEST_GAP_S:
            samples.clear()
        if samples and t_s <= samples[-1][0]:
            return None
        samples.append((t_s, mpos))
        # One sample may lie before the window, so that it is always spanned.
        while len(samples) > 2 and samples[1][0] <= t_s - self._window_s:
            samples.popleft()
        first_s = samples[0][0]
        if len(samples) < 2 or t_s - first_s < _SHORTEST_S:
            return None
        return self._state()

    def _state(self) -> ArmState | None:
        times = np.array([t for t, _ in self._samples])
        positions = np.array([mpos for _, mpos in self._samples])
        middle_s = float(np.mean(times))
        if middle_s <= self._last_s:
            return None
        self._last_s = middle_s
        offsets = times - middle_s
        slope = offsets @ positions / float(offsets @ offsets)
        q = self._kinematics.joints(np.mean(positions, axis=0))
        qd = self._kinematics.joint_rates_of(slope)
        return ArmState(
            t_s=middle_s,
            T_base_tool=self._kinematics.tool_pose(q),
            twist_tool=self._kinematics.tool_twist(q, qd),
        )
