"""Lines to actions: ``$`` commands, jogs and G-code, with the firmware's refusals."""

import numpy as np

from sim_backend.loopback_grbl import gcode
from sim_backend.loopback_grbl.gcode import GcodeError, Modes, Move, parse_move
from sim_backend.loopback_grbl.machine import FloatArray, Machine
from sim_backend.loopback_grbl.replies import build_info, settings_list
from sim_backend.loopback_grbl.states import States


class Interpreter:
    """Executes one line after another and answers each with ``ok`` or ``error:<code>``.

    A G-code error is sticky: every further G-code line repeats it until an empty line, a ``$``
    command or a reset. Jogs pass it by.
    """

    def __init__(self, machine: Machine, states: States) -> None:
        self._machine = machine
        self._states = states
        self._modes = Modes()
        self._sticky: int | None = None
        self._at: FloatArray | None = None  # where the programme is; None: where the axes are

    def reset(self) -> None:
        """Forget modes, error and programme position."""
        self._modes = Modes()
        self._sticky = None
        self._at = None

    def execute(self, line: str) -> None:
        """Execute one line without its end."""
        text = line.strip()
        try:
            answered = self._dispatch(text)
        except GcodeError as error:
            self._states.say(f"error:{error.code}")
            if text and not text.startswith("$"):
                self._sticky = error.code
        else:
            if not answered:
                self._states.say("ok")

    def _dispatch(self, text: str) -> bool:
        """Returns whether the answer has been, or will be, given by somebody else."""
        upper = text.upper()
        if self._states.needs_reset and text:
            raise GcodeError(gcode.RESET_NEEDED)
        if upper.startswith("$J="):
            self._jog(text[3:])
            return False
        if not text or text.startswith("$"):
            self._sticky = None
            return self._system(upper)
        if self._sticky is not None:
            raise GcodeError(self._sticky)
        if self._states.state in ("Alarm", "Jog"):
            raise GcodeError(gcode.LOCKED)
        return self._gcode(text)

    def _system(self, text: str) -> bool:
        if text in ("$$", "$I"):
            lines = settings_list if text == "$$" else build_info
            for line in lines(self._machine):
                self._states.say(line)
        elif text == "$X":
            self._unlock()
        elif text == "$H":
            self._home()
            return True
        elif text:
            raise GcodeError(gcode.BAD_STATEMENT)
        return False

    def _unlock(self) -> None:
        if "E" in self._states.pressed:
            raise GcodeError(gcode.RESET_NEEDED)
        if self._states.state == "Alarm":
            self._states.unlock()

    def _home(self) -> None:
        if not self._machine.homing:
            raise GcodeError(gcode.HOMING_DISABLED)
        if self._states.state not in ("Idle", "Alarm"):
            raise GcodeError(gcode.NOT_IDLE)
        self._at = None
        self._states.home()

    def _jog(self, text: str) -> None:
        states = self._states
        if states.state == "Alarm":
            raise GcodeError(gcode.LOCKED)
        if states.state not in ("Idle", "Jog"):
            raise GcodeError(gcode.NOT_IDLE)
        at = self._position()
        move = parse_move(text, self._machine.letters, self._modes, at, jog=True)
        assert move is not None  # a jog without a motion has been refused
        if self._outside(move):
            raise GcodeError(gcode.JOG_BEYOND_LIMITS)
        self._plan(move, jog=True)

    def _gcode(self, text: str) -> bool:
        move = parse_move(text, self._machine.letters, self._modes, self._position(), jog=False)
        if move is None:
            return False
        if self._outside(move):
            self._at = None
            self._states.soft_limit()
            return True
        self._plan(move, jog=False)
        return False

    def _plan(self, move: Move, jog: bool) -> None:
        self._at = move.target
        if self._states.motion.planner.add(move.target, move.feed):
            self._states.moved(jog)

    def _position(self) -> FloatArray:
        """Where the next line starts: the end of the queue, unrounded while it lasts."""
        planner = self._states.motion.planner
        end = planner.position
        # After a cancel the queue ends elsewhere than the programme thought.
        if self._at is None or np.max(np.abs(self._at - end)) > 0.5 / self._coarsest() + 1e-9:
            self._at = end.copy()
        return self._at

    def _coarsest(self) -> float:
        return min(self._machine.steps_per_unit[: self._machine.axes])

    def _outside(self, move: Move) -> bool:
        low, high = (
            self._machine.column(self._machine.low),
            self._machine.column(self._machine.high),
        )
        beyond = np.any(move.target < low - 1e-9) or np.any(move.target > high + 1e-9)
        return self._machine.soft_limits and bool(beyond)
