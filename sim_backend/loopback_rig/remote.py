"""The motion of an emulated controller that runs in a process of its own, as a camera needs it."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from sim_backend.history import JointHistory

FloatArray = NDArray[np.float64]


class MotionSource(Protocol):
    """The control connection of a loopback controller."""

    def motion(self, since_s: float) -> FloatArray:
        """Rows (t_s, q (6), qd (6)), equally spaced, at and after an instant."""
        ...


class RemoteMotion:
    """Follows a controller's true motion, and with it a camera bolted to its tool.

    ``tool_pose`` maps joint positions (6,) to T_base_tool (4, 4). One thread uses it, and
    nobody else uses ``source``.
    """

    def __init__(
        self,
        source: MotionSource,
        tool_pose: Callable[[FloatArray], FloatArray],
        T_tool_camera: FloatArray,
        clock: Clock,
    ) -> None:
        self.clock = clock
        self._source = source
        self._tool_pose = tool_pose
        self._T_tool_camera = T_tool_camera
        rows = source.motion(0.0)
        while len(rows) < 2:
            clock.sleep_until(clock.now_s() + 0.01)
            rows = source.motion(0.0)
        self._step_s = float(rows[1, 0] - rows[0, 0])
        self._history = self._begun(rows)

    def sync(self) -> float:
        """Fetch what is new; the newest recorded instant: a camera must not look further."""
        newest_s = self._history.time_s(self._history.count - 1)
        rows = self._source.motion(newest_s + 0.5 * self._step_s)
        if len(rows) and rows[0, 0] > newest_s + 1.5 * self._step_s:
            # Nobody looked for so long that the controller gave the middle up.
            self._history = self._begun(rows)
        else:
            _append(self._history, rows)
        return min(self.clock.now_s(), self._history.time_s(self._history.count - 1))

    def T_base_camera(self, t_s: float) -> FloatArray:
        """Pose (4, 4) at ``t_s``; raises ValueError outside the recorded motion."""
        pose: FloatArray = self._tool_pose(self._history.at(t_s)[0]) @ self._T_tool_camera
        return pose

    def _begun(self, rows: FloatArray) -> JointHistory:
        history = JointHistory(float(rows[0, 0]), self._step_s)
        _append(history, rows)
        return history


def _append(history: JointHistory, rows: FloatArray) -> None:
    for row in rows:
        history.append(row[1:7], row[7:13])
