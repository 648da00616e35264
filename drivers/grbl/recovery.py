"""Getting a locked or held controller going again, without resuming any old motion."""

from collections.abc import Callable

from drivers.clock import Clock
from drivers.errors import OperateError
from drivers.grbl.handshake import Conversation
from drivers.grbl.link import Link
from drivers.grbl.protocol import Banner, Refusal, Status
from drivers.grbl.settings import GrblSettings
from drivers.grbl.words import alarm_words, door_words, error_words, pin_words

Action = Callable[[Link, Clock, GrblSettings], None]

_RESET = b"\x18"
_BANNER_S = 3.0
_STATUS_S = 2.0
_SETTLE_S = 0.1
_HOMING_S = 120.0


def explain(status: Status) -> str:
    """What the reported state means and what a recovery will do about it."""
    pins = f" Active inputs: {pin_words(status.pins)}." if status.pins else ""
    match status.state:
        case "Idle":
            return "The gantry is ready; nothing to recover." + pins
        case "Alarm":
            what = f"The gantry is locked: {alarm_words(status.part)}.{pins}"
            return what + " Recovering resets and unlocks it; the position may need homing."
        case "Door":
            what = f"The gantry holds: {door_words(status.part)}.{pins}"
            return what + " Recovering drops the interrupted motion."
        case "Hold":
            return f"The gantry is in feed hold.{pins} Recovering drops the interrupted motion."
        case "Jog":
            return "The gantry is moving; recovering stops it."
        case _:
            return f"The gantry is in state {status.state}.{pins} Recovering resets it."


def unlock(link: Link, clock: Clock, settings: GrblSettings) -> None:
    """Reset and unlock; raises OperateError, saying why, where it stays locked.

    A reset rather than a resume: what was interrupted is dropped.
    """
    talk = Conversation(link, clock, settings)
    status = talk.status(_STATUS_S)
    if status is not None and status.state == "Jog":
        link.write(b"\x85")
        status = _after_jog(talk)
    if status is None or status.state != "Idle":
        link.write(_RESET)
        talk.listen(_BANNER_S, lambda message: isinstance(message, Banner))
        talk.listen(_SETTLE_S, lambda message: False)
        status = talk.status(_STATUS_S)
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


def home(link: Link, clock: Clock, settings: GrblSettings) -> None:
    """Run the controller's homing cycle; raises OperateError where it fails.

    The gantry moves: make room first.
    """
    talk = Conversation(link, clock, settings)
    answer = talk.ask("$H", _HOMING_S)[-1]
    if isinstance(answer, Refusal):
        raise OperateError(
            f"the gantry on {settings.port} refused to home: {error_words(answer.code)}"
        )
