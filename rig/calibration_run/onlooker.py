"""An arm that somebody else moves: where it is and whether it rests, without any command."""

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import DeviceTimeoutError
from drivers.interfaces import Arm, ArmState
from rig.calibration_run.errors import PoseRefusedError, StopRequestedError

FloatArray = NDArray[np.float64]

_PERIOD_S = 0.01
_FIRST_STATE_S = 2.0
_REST_S = 0.3
# A hand that holds an arm trembles; the corners' own motion is looked at besides.
_AT_REST_M_S, _AT_REST_RAD_S = 3e-3, 0.012
_KEPT = 2000  # states


class Onlooker:
    """Stands in for a ``Mover`` where pictures are taken, for an arm that is led by hand."""

    def __init__(self, arm: Arm, clock: Clock, stop_requested: Callable[[], bool]) -> None:
        self._arm = arm
        self._clock = clock
        self._stop_requested = stop_requested
        self._states: deque[ArmState] = deque(maxlen=_KEPT)

    @property
    def T_base_tool(self) -> FloatArray:
        """The newest measured pose (4, 4)."""
        return self.look().T_base_tool

    def look(self) -> ArmState:
        """The newest state, waited for at the start; raises DeviceTimeoutError without one."""
        deadline_s = self._clock.now_s() + _FIRST_STATE_S
        self._states.extend(self._arm.read_states())
        while not self._states:
            if self._clock.now_s() > deadline_s:
                raise DeviceTimeoutError("the arm reports no state: check its connection and power")
            self._clock.sleep_until(self._clock.now_s() + _PERIOD_S)
            self._states.extend(self._arm.read_states())
        return self._states[-1]

    def rests_since_s(self) -> float:
        """Since when the arm has been at rest; infinite while it moves."""
        newest_s, since_s = self.look().t_s, np.inf
        for state in reversed(self._states):
            v, w = np.linalg.norm(state.twist_tool[:3]), np.linalg.norm(state.twist_tool[3:])
            if v > _AT_REST_M_S or w > _AT_REST_RAD_S:
                break
            since_s = state.t_s
        return float(since_s) if newest_s - since_s >= _REST_S else float("inf")

    def settle(self, timeout_s: float = 2.0) -> float:
        """Wait until the arm rests; since when it has.

        Raises PoseRefusedError when it moves on, StopRequestedError.
        """
        deadline_s = self._clock.now_s() + timeout_s
        while not np.isfinite(since_s := self.rests_since_s()):
            if self._clock.now_s() > deadline_s:
                raise PoseRefusedError("the arm still moves: let go of it, then press the key")
            self.wait(_PERIOD_S)
        return since_s

    def wait(self, duration_s: float) -> None:
        """Let time pass; raises StopRequestedError."""
        self._clock.sleep_until(self._clock.now_s() + duration_s)
        self.look()
        if self._stop_requested():
            raise StopRequestedError("stopped on request")
