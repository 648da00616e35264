"""The control script that ``ur_rtde`` uploads, as the registers show it: commands in, states out.

The script itself is not interpreted. Uploading any program whose text reads the command
register starts this emulation of it; command 255 or an end from outside stops it.
Assumed: a command takes effect in the cycle after its arrival, and a ``moveL`` may take a
joint-space path to its goal (the real one is a straight line).
"""

import math
from typing import Protocol

import numpy as np

from sim_backend.loopback_ur.kinematics import joints_for, pose_vector, transform
from sim_backend.loopback_ur.motion import STEP_S, Motion

READY, DONE = 1, 2

_STREAMING = frozenset({6, 9, 10, 11, 24, 25, 26, 27, 38, 58, 66, 67, 68, 69, 70, 71})
SET_WATCHDOG, STOP_SCRIPT = 35, 255
_SHORTEST_PERIOD_HZ = 500.0


class Registers(Protocol):
    """The controller's general purpose registers."""

    def input_int(self, i: int) -> int:
        """Input integer register ``i``."""
        ...

    def input_double(self, i: int) -> float:
        """Input double register ``i``."""
        ...

    def set_output_int(self, i: int, value: int) -> None:
        """Write output integer register ``i``."""
        ...

    def set_output_double(self, i: int, value: float) -> None:
        """Write output double register ``i``."""
        ...


class ControlProgram:
    """One running instance of the uploaded script."""

    def __init__(self, registers: Registers, motion: Motion) -> None:
        self._registers = registers
        self._motion = motion
        self._executing: int | None = None
        self.watchdog_s: float | None = None  # longest silence of the command register
        self.wants_protective_stop = False
        self.ended = False
        registers.set_output_int(0, READY)

    def step(self) -> None:
        """Run one cycle: look at the command register, act, report."""
        registers = self._registers
        command = registers.input_int(0)
        if command in _STREAMING:
            self._stream(command)
            registers.set_output_int(0, READY)
        elif command == 0:
            self._executing = None
            registers.set_output_int(0, READY)
        elif self._executing is None:
            self._executing = command
            self._start(command)
        if self._executing is not None and self._finished(self._executing):
            registers.set_output_int(0, DONE)

    def _stream(self, command: int) -> None:
        vector = self._vector()
        if command == 10:
            self._motion.speed_tool(vector, self._double(6))
        elif command == 9:
            self._motion.speed_joint(vector, self._double(6))

    def _start(self, command: int) -> None:
        motion = self._motion
        if command in (1, 3):
            self._start_move(command)
        elif command in (15, 33):
            motion.stop_tool(max(self._double(0), 0.01))
        elif command == 34:
            motion.stop_joint(max(self._double(0), 0.01))
        elif command == 31:
            self.wants_protective_stop = True
        elif command == SET_WATCHDOG:
            hz = min(self._double(0), _SHORTEST_PERIOD_HZ)
            self.watchdog_s = 1.0 / hz if hz > 0.0 else None
        elif command == 47:  # is the arm at rest?
            self._registers.set_output_int(1, int(motion.at_rest))
        elif command == 40:  # the TCP's offset
            for i, value in enumerate(pose_vector(motion.T_flange_tool)):
                self._registers.set_output_double(i, value)
        elif command == STOP_SCRIPT:
            self.ended = True

    def _start_move(self, command: int) -> None:
        goal = self._vector()
        speed, acceleration = max(self._double(6), 1e-3), max(self._double(7), 1e-3)
        if command == 3:
            pose = transform(tuple(float(x) for x in goal))
            try:
                goal = joints_for(pose, self._motion.q, self._motion.T_flange_tool)
            except ValueError:
                # A pose without inverse kinematics ends a real program with an error.
                self.ended = True
                return
            reach = float(np.linalg.norm(pose[:3, 3] - self._motion.actual()[0][:3, 3]))
            turn = float(np.abs(goal - self._motion.q).max())
            factor = turn / reach if reach > 1e-6 else 1.0
            speed, acceleration = min(speed * factor, math.pi), min(acceleration * factor, 40.0)
        self._motion.move(goal, speed, acceleration)

    def _finished(self, command: int) -> bool:
        if command in (1, 3):
            return self._motion.arrived or self._registers.input_int(1) == 1
        if command in (15, 33, 34):
            return self._motion.at_rest or (command != 15 and self._registers.input_int(1) == 1)
        return True

    def _vector(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return np.array([self._double(i) for i in range(6)])

    def _double(self, i: int) -> float:
        value = self._registers.input_double(i)
        return value if math.isfinite(value) else 0.0


def watchdog_cycles(period_s: float) -> int:
    """The number of silent cycles after which a watchdog of ``period_s`` fires."""
    return max(1, math.ceil(period_s / STEP_S - 1e-9))
