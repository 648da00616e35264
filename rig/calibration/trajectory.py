"""Where the arm was at any instant, from its samples."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.calibration import se3
from rig.calibration.errors import CalibrationError

FloatArray = NDArray[np.float64]

_LONGEST_GAP_S = 0.2
_TWIST_HALF_WIDTH_S = 0.008  # the encoders' steps vanish over this, the motion does not


class Trajectory:
    """Arm poses between samples: along the screw motion from each sample to the next.

    Nothing is extrapolated.
    """

    def __init__(self, times_s: ArrayLike, T_base_tool: FloatArray) -> None:
        """Samples at increasing instants (n,) with poses (n, 4, 4).

        Raises CalibrationError for fewer than two, instants that do not increase, or a gap.
        """
        times = np.asarray(times_s, dtype=float)
        if len(times) < 2 or len(times) != len(T_base_tool):
            raise CalibrationError(f"{len(times)} arm samples: at least two are needed, with poses")
        steps = np.diff(times)
        if np.any(steps <= 0.0):
            raise CalibrationError("the arm's stamps do not increase")
        if np.max(steps) > _LONGEST_GAP_S:
            at = int(np.argmax(steps))
            raise CalibrationError(
                f"the arm was silent for {steps[at]:.2f} s from {times[at]:.2f} s on: "
                "record the motion again"
            )
        self._times = times
        self._steps = steps
        self._poses = np.asarray(T_base_tool, dtype=float)
        self._moves = se3.log(se3.inverse(self._poses[:-1]) @ self._poses[1:])

    @property
    def start_s(self) -> float:
        """The first sample's instant."""
        return float(self._times[0])

    @property
    def end_s(self) -> float:
        """The last sample's instant."""
        return float(self._times[-1])

    def holds(self, times_s: FloatArray) -> NDArray[np.bool_]:
        """Which instants lie inside the recorded span, far enough in for ``twists``."""
        margin = _TWIST_HALF_WIDTH_S
        return (times_s >= self.start_s + margin) & (times_s <= self.end_s - margin)

    def poses(self, times_s: FloatArray) -> FloatArray:
        """T_base_tool (k, 4, 4); raises CalibrationError outside the recorded span."""
        times = np.asarray(times_s, dtype=float)
        if len(times) and (times.min() < self.start_s or times.max() > self.end_s):
            raise CalibrationError(
                f"the arm's pose is asked for outside its record, {self.start_s:.3f} s to "
                f"{self.end_s:.3f} s: record the arm for longer before and after the images"
            )
        i = np.clip(np.searchsorted(self._times, times, side="right") - 1, 0, len(self._steps) - 1)
        share = (times - self._times[i]) / self._steps[i]
        return self._poses[i] @ se3.exp(share[:, None] * self._moves[i])

    def twists(self, times_s: FloatArray) -> FloatArray:
        """The tool's twist (k, 6) in its own axes, by central differences of the poses."""
        h = _TWIST_HALF_WIDTH_S
        before, after = self.poses(times_s - h), self.poses(times_s + h)
        return se3.log(se3.inverse(before) @ after) / (2.0 * h)
