"""Getting a locked or held controller going again, without resuming any old motion; homing."""

import contextlib
from collections.abc import Callable

from drivers.clock import Clock
from drivers.errors import OperateError, RigError
from drivers.grbl.handshake import Conversation
from drivers.grbl.link import Link
from drivers.grbl.protocol import AlarmMessage, Banner, Ok, Refusal, Status
from drivers.grbl.settings import GrblSettings
from drivers.grbl.words import alarm_words, door_words, error_words, pin_words

Action = Callable[[Link, Clock, GrblSettings], None]

_RESET = b"\x18"
_BANNER_S = 3.0
_STATUS_S = 2.0
_SETTLE_S = 0.1
_HOMING_S = 180.0
_EMERGENCY_ALARM = 10


def explain(status: Status) -> str:
    """What the reported state means and what a recovery will do about it."""
    pins = f" Active inputs: {pin_words(status.pins)}." if status.pins else ""
    match status.state:
        case "Idle":
            return "The gantry is ready; nothing to recover." + pins + homing_words(status)
        case "Alarm":
            what = f"The gantry is locked: {alarm_words(status.part)}.{pins}"
            return what + " Recovering resets and unlocks it; the position may need homing."
        case "Door":
            what = f"The gantry holds: {door_words(status.part)}.{pins}"
            return what + " Recovering drops the interrupted motion."
        case "Hold":
            return f"The gantry is in feed hold.{pins} Recovering drops the interrupted motion."
        case "Home":
            return "The gantry is homing: wait until it is done. Recovering stops it half-way."
        case "Jog":
            return "The gantry is moving; recovering stops it."
        case _:
            return f"The gantry is in state {status.state}.{pins} Recovering resets it."


def unlock(link: Link, clock: Clock, settings: GrblSettings) -> None:
    """Reset and unlock; raises OperateError, saying why, where it stays locked.

    A reset rather than a resume: what was interrupted is dropped.
    """
    talk = Conversation(link, clock, settings)
    status = _at_rest(talk)
    if status is not None and status.state == "Alarm":
        answer = talk.ask("$X")[-1]
        if isinstance(answer, Refusal):
            raise OperateError(
                f"the gantry on {settings.port} stays locked: {error_words(answer.code)}; "
                f"{alarm_words(status.part)}"
            )
        status = talk.status(_STATUS_S)
    if status is None or status.state != "Idle":
        why = "it does not answer" if status is None else explain(status)
        raise OperateError(f"the gantry on {settings.port} could not be recovered: {why}")


def _after_jog(talk: Conversation) -> Status | None:
    """The first report that is not of a jog, or the last one within the time for braking."""
    status = None
    deadline_s = talk.clock.now_s() + _STATUS_S
    while talk.clock.now_s() < deadline_s:
        status = talk.status(_STATUS_S)
        if status is None or status.state != "Jog":
            break
    return status


def _at_rest(talk: Conversation) -> Status | None:
    """The state after any jog was cancelled and anything else that keeps it busy was reset."""
    status = talk.status(_STATUS_S)
    if status is not None and status.state == "Jog":
        talk.link.write(b"\x85")
        status = _after_jog(talk)
    if status is None or status.state != "Idle":
        talk.link.write(_RESET)
        talk.listen(_BANNER_S, lambda message: isinstance(message, Banner))
        talk.listen(_SETTLE_S, lambda message: False)
        status = talk.status(_STATUS_S)
    return status


def homing_words(status: Status) -> str:
    """Whether the axes know where they are; empty where the controller does not say."""
    if status.homed is None:
        return ""
    return " It is homed." if status.homed else " It has not been homed since it was switched on."


def home(link: Link, clock: Clock, settings: GrblSettings) -> None:
    """Run the controller's homing cycle; raises OperateError, saying why, where it fails.

    The gantry moves: make room first. Left early, by Ctrl-C or an error, it is reset, which
    stops it at once.
    """
    where = f"the gantry on {settings.port}"
    talk = Conversation(link, clock, settings)
    status = _at_rest(talk)
    if status is None:
        raise OperateError(f"{where} cannot be homed: it does not answer")
    pressed = status.state == "Alarm" and status.part == _EMERGENCY_ALARM
    if status.state not in ("Idle", "Alarm") or pressed:
        raise OperateError(f"{where} cannot be homed: {explain(status)}")
    answered = False
    try:
        link.write(b"$H\n")
        heard = talk.listen(_HOMING_S, lambda m: isinstance(m, Ok | Refusal | AlarmMessage))
        answer = heard[-1] if heard else None
        answered = isinstance(answer, Ok | Refusal)
    finally:
        if not answered:
            with contextlib.suppress(RigError):  # what went wrong first is what counts
                link.write(_RESET)
    match answer:
        case Ok():
            return
        case Refusal(code):
            raise OperateError(f"{where} refused to home: {error_words(code)}")
        case AlarmMessage(code):
            raise OperateError(f"{where} could not be homed: {alarm_words(code)}")
        case _:
            raise OperateError(
                f"{where} was not homed within {_HOMING_S:g} s and was reset: look at its axes "
                "and switches"
            )
