"""A UR5e on simulated time: the emulated controller's motion behind the ``Arm`` interface.

No sockets and no processes, so that hours of motion are looked through in minutes; what the
controller would object to is raised as the driver would.
"""

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState, Joints
from drivers.ur.faults import ProtectiveStopError
from drivers.ur.geometry import to_base_axes, to_tool_axes
from drivers.ur.kinematics import identify
from sim_backend.clock import SimulatedClock
from sim_backend.loopback_ur.motion import STEP_S, Motion, MotionConfig

FloatArray = NDArray[np.float64]

_TCP = (0.0,) * 6
_RESENT_EVERY = 2  # cycles
_ACCELERATION, _STOP_ACCELERATION = 4.0, 5.0  # the driver's defaults


class SimulatedUr:
    """Follows tool twists from joints ``q`` (6,) on, as the driver and the controller would."""

    def __init__(self, q: FloatArray, clock: SimulatedClock) -> None:
        self._clock = clock
        self._motion = Motion(MotionConfig(), q, np.eye(4))
        self._start_s, self._cycles = clock.now_s(), 0
        self._twist, self._until_s = np.zeros(6), -np.inf
        self._states: list[ArmState] = []
        self._fault: ProtectiveStopError | None = None
        self._model = identify(q, self._motion.actual()[0], _TCP)
        self.fastest_rad_s = 0.0  # that a joint went so far
        self._report()

    @property
    def q(self) -> FloatArray:
        """Where the joints are (6,)."""
        return self._motion.q

    def read_states(self) -> list[ArmState]:
        """Every sample since the last call; raises ProtectiveStopError with the reason."""
        self._advance()
        if self._fault is not None:
            raise self._fault
        states, self._states = self._states, []
        return states

    def joints(self) -> Joints | None:
        """The joints now."""
        return None if self._model is None else self._model.joints(self._motion.q.copy())

    def command_twist(self, twist_tool: FloatArray, hold_s: float) -> None:
        """Follow ``twist_tool`` (6,) for ``hold_s``."""
        self._advance()
        self._twist, self._until_s = np.array(twist_tool), self._clock.now_s() + hold_s

    def stop(self) -> None:
        """Brake."""
        self._advance()
        self._until_s = -np.inf

    def close(self) -> None:
        """Brake."""
        self.stop()

    def _advance(self) -> None:
        motion = self._motion
        while self._t_s() + STEP_S <= self._clock.now_s() + 1e-9:
            self._cycles += 1
            if self._cycles % _RESENT_EVERY == 0 and self._fault is None:
                self._send()
            motion.step()
            self.fastest_rad_s = max(self.fastest_rad_s, float(np.abs(motion.qd_target).max()))
            if motion.violation is not None and self._fault is None:
                self._fault = ProtectiveStopError(motion.violation)
                motion.stop_joint(MotionConfig().protective_stop_rad_s2)
            self._report()

    def _send(self) -> None:
        if self._t_s() < self._until_s:
            R = self._motion.actual()[0][:3, :3]
            self._motion.speed_tool(to_base_axes(R, self._twist), _ACCELERATION)
        else:
            self._motion.speed_tool(np.zeros(6), _STOP_ACCELERATION)

    def _report(self) -> None:
        T, twist = self._motion.actual()[0], self._motion.twist_base()
        self._states.append(ArmState(self._t_s(), T.copy(), to_tool_axes(T[:3, :3], twist)))

    def _t_s(self) -> float:
        return self._start_s + self._cycles * STEP_S
