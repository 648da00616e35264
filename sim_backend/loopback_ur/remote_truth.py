"""The emulated arm's true motion seen from another process, so that a camera's rendering never
holds up the controller's 2 ms cycle.
"""

import threading

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from sim_backend.history import JointHistory
from sim_backend.loopback_ur.motion import STEP_S
from sim_backend.loopback_ur.process import LoopbackControl
from sim_backend.loopback_ur.truth import ArmTruth

FloatArray = NDArray[np.float64]


class RemoteTruth:
    """A copy of the controller's recorded motion, brought up to date by ``sync``.

    Safe for several threads; the control connection is used by nobody else.
    """

    def __init__(self, control: LoopbackControl, T_flange_tool: FloatArray, clock: Clock) -> None:
        self.clock = clock
        self._control = control
        self._lock = threading.Lock()
        self._T_flange_tool = T_flange_tool
        self._truth = self._begin(control.motion())

    def sync(self) -> float:
        """Fetch what happened since the last call; the newest recorded instant."""
        with self._lock:
            history = self._truth.history
            newest_s = history.time_s(history.count - 1)
            rows = self._control.motion(newest_s + 0.5 * history.step_s)
            if len(rows) and rows[0, 0] > newest_s + 1.5 * history.step_s:
                # Nobody looked for so long that the controller gave the middle up.
                self._truth = self._begin(rows)
            else:
                _append(history, rows[rows[:, 0] > newest_s + 0.5 * history.step_s])
            return self._truth.sync()

    def T_base_tool(self, t_s: float) -> FloatArray:
        """Pose (4, 4) of the tool at ``t_s``; raises ValueError outside what was fetched."""
        return self._truth.T_base_tool(t_s)

    def twist_base(self, t_s: float) -> FloatArray:
        """Twist (6,) of the tool at ``t_s``, in base axes."""
        return self._truth.twist_base(t_s)

    def _begin(self, rows: FloatArray) -> ArmTruth:
        history = JointHistory(float(rows[0, 0]), STEP_S)
        _append(history, rows)
        return ArmTruth(history, self._T_flange_tool, self.clock)


def _append(history: JointHistory, rows: FloatArray) -> None:
    for row in rows:
        history.append(row[1:7], row[7:])
