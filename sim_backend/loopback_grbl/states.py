"""The controller's state machine: Idle, Jog, Run, Hold, Door, Home, Alarm, and their changes.

Measured: the stop table, ALARM:2 without ok, error:79 until a reset, Hold and resume. Assumed,
after Grbl's documentation: a reset in motion locks with ALARM:3, a hard limit is ALARM:1, an
emergency stop ALARM:10, an open door decelerates and shows Door:1, then Door:0 once closed.
"""

from sim_backend.loopback_grbl.machine import FloatArray, Machine
from sim_backend.loopback_grbl.motion import Motion

_UNLOCK = "[MSG:'$H'|'$X' to unlock]"
_RESET_TO_CONTINUE = "[MSG:Reset to continue]"


class States:
    """What the controller is doing; time is the firmware's own."""

    def __init__(self, machine: Machine, start: FloatArray, locked: bool) -> None:
        self._machine = machine
        self.motion = Motion(machine, start)
        self.now_s = 0.0
        self.state = "Alarm" if locked else "Idle"
        self.needs_reset = False
        self.homed = not locked
        self.pressed = ""  # pins held active: D door, E emergency stop
        self._alarm = 0
        self._alarm_at_rest: int | None = None
        self._messages: list[str] = []

    @property
    def shown(self) -> str:
        """The state as the status report spells it."""
        if self.state == "Hold":
            return "Hold:0" if self.motion.at_rest else "Hold:1"
        if self.state == "Door":
            if not self.motion.at_rest:
                return "Door:2"
            return "Door:1" if "D" in self.pressed else "Door:0"
        if self.state == "Alarm" and self._alarm:
            return f"Alarm:{self._alarm}"
        return self.state

    @property
    def pins(self) -> str:
        """The pins field of the report."""
        limit = "X" if self._alarm == 1 else ""
        return limit + self.pressed

    @property
    def accepts_lines(self) -> bool:
        """Whether lines are parsed at all."""
        return self.state not in ("Hold", "Door", "Home") and self._alarm_at_rest is None

    def say(self, text: str) -> None:
        """Print a line."""
        self._messages.append(text)

    def take_messages(self) -> list[str]:
        """The lines printed since the last call."""
        taken, self._messages = self._messages, []
        return taken

    def advance(self, now_s: float) -> None:
        """Let the motion go on to ``now_s`` and follow what it brings about."""
        self.now_s = now_s
        self.motion.advance(now_s)
        if not self.motion.at_rest:
            return
        if self._alarm_at_rest is not None:
            self._lock(self._alarm_at_rest)
        elif self.state in ("Jog", "Run"):
            self.state = "Idle"
        elif self.state == "Home":
            self.state, self.homed = "Idle", True
            self.say("ok")

    def moved(self, jog: bool) -> None:
        """A block has been planned."""
        self.state = "Jog" if jog else "Run"

    def cancel_jog(self) -> bool:
        """0x85: honoured while jogging only."""
        if self.state != "Jog":
            return False
        self.motion.cancel(self.now_s)
        return True

    def hold(self) -> None:
        """``!``: decelerate after the committed segments, keep the queue."""
        if self.state == "Run":
            self.motion.hold()
            self.state = "Hold"

    def resume(self) -> None:
        """``~``: go on after a hold, or after a door that is closed again."""
        if self.state == "Hold" and self.motion.at_rest:
            self.motion.resume()
            self.state = "Run"
        elif self.state == "Door" and self.motion.at_rest and "D" not in self.pressed:
            self.motion.resume()
            self.state = "Run" if self.motion.planner.blocks else "Idle"

    def open_door(self) -> None:
        """The safety door opens: a jog is cancelled, a programme held."""
        if self.state == "Jog":
            self.motion.cancel(self.now_s)
        elif self.state == "Run":
            self.motion.hold()
        if self.state in ("Idle", "Jog", "Run", "Hold"):
            self.state = "Door"

    def soft_limit(self) -> None:
        """A G1 beyond the travel: decelerate, then ALARM:2; the line gets no ``ok``."""
        self.motion.hold()
        self._alarm_at_rest = 2

    def hard_limit(self) -> None:
        """A limit switch closes: the step pulses end at once."""
        self._lock(1)

    def emergency_stop(self) -> None:
        """The emergency input: the step pulses end at once."""
        self.pressed += "E"
        self._lock(10)

    def reset(self) -> None:
        """0x18: everything stops without deceleration and the banner is printed."""
        in_motion = not self.motion.at_rest and self.state in ("Jog", "Run", "Home", "Hold")
        self.motion.kill(self.now_s)
        self._alarm_at_rest = None
        if "E" in self.pressed:
            self._lock(10)
        else:
            self._unlock_or_lock(in_motion)
        self.say(self._machine.banner)
        if self.state == "Alarm":
            self.say(_UNLOCK)

    def unlock(self) -> None:
        """``$X``: leave the alarm, keeping the position."""
        self.state, self._alarm = "Idle", 0
        self.say("[MSG:Caution: Unlocked]")

    def home(self) -> None:
        """``$H``: drive to the home corner; assumed: one straight rapid, then machine zero."""
        position = self.motion.counted(self.now_s)
        self.motion.kill(self.now_s)
        self._alarm = 0
        if self.motion.planner.add(0.0 * position, None):
            self.state = "Home"
        else:
            self.state, self.homed = "Idle", True
            self.say("ok")

    def _lock(self, code: int) -> None:
        self.motion.kill(self.now_s)
        self._alarm_at_rest = None
        self.state, self._alarm, self.needs_reset = "Alarm", code, True
        self.say(f"ALARM:{code}")
        self.say(_RESET_TO_CONTINUE)

    def _unlock_or_lock(self, in_motion: bool) -> None:
        self.needs_reset = False
        if in_motion:
            self.say("ALARM:3")
        if in_motion or self.state == "Alarm":
            self.state, self._alarm = "Alarm", 3 if in_motion else 0
        elif "D" in self.pressed:
            self.state = "Door"
        else:
            self.state = "Idle"
