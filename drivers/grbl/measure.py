"""From reported positions to measured motion: a straight line through the last reports."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from drivers.grbl.kinematics import GantryKinematics
from drivers.grbl.timing import rate_spectrum, rate_std
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

    ``step`` (n,) is what the machine positions are rounded to, ``stamp_std_s`` the standard
    deviation of their instants; each state carries what follows from them.
    """

    def __init__(
        self, kinematics: GantryKinematics, window_s: float, step: FloatArray, stamp_std_s: float
    ) -> None:
        self._kinematics = kinematics
        self._window_s = window_s
        self._step = step
        self._stamp_std_s = stamp_std_s
        self._last_slope: FloatArray | None = None
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
            self._last_slope = None
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
        offsets = times - middle_s
        slope = offsets @ positions / float(offsets @ offsets)
        q = self._kinematics.joints(np.mean(positions, axis=0))
        qd = self._kinematics.joint_rates_of(slope)
        covariance, spectrum = self._uncertainty(q, slope, middle_s, float(times[-1] - times[0]))
        state = ArmState(
            t_s=middle_s,
            T_base_tool=self._kinematics.tool_pose(q),
            twist_tool=self._kinematics.tool_twist(q, qd),
            t_std_s=self._stamp_std_s / math.sqrt(len(times)),
            twist_covariance=covariance,
            twist_spectrum=spectrum,
        )
        self._last_s, self._last_slope = middle_s, slope
        return state

    def _uncertainty(
        self, q: FloatArray, slope: FloatArray, middle_s: float, window_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Covariance and spectrum of the tool's twist (6, 6), the axes' errors independent."""
        change = np.zeros_like(slope)
        if self._last_slope is not None:
            change = (slope - self._last_slope) / (middle_s - self._last_s)
        std = rate_std(self._step, slope, change, self._stamp_std_s, window_s)
        density = rate_spectrum(self._step, slope, change, self._stamp_std_s, window_s)
        J, joints = self._kinematics.tool_jacobian(q), self._kinematics.joint_rates_of
        spread, drift = J * joints(std), J * joints(np.sqrt(density))
        return spread @ spread.T, drift @ drift.T
