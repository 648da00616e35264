"""From what the controller says to a typed error that says what to do."""

from drivers.errors import RigError
from drivers.grbl.errors import AlarmError, GantryError, HeldError, RefusedError, ResetError
from drivers.grbl.protocol import AlarmMessage, Banner, Refusal, Status
from drivers.grbl.words import alarm_words, door_words, error_words, pin_words

_RECOVER = "then `rig arm recover --arm grbl --port {port}`"
_HOME = "then `rig arm home --arm grbl --port {port}`, or `rig arm recover` to unlock it as it is"
# Alarms after which the axes may no longer be where they are counted to be.
_LOST = (1, 3, 6, 7, 8, 9, 11, None)


def from_message(message: Refusal | AlarmMessage | Banner, port: str) -> RigError:
    """The failure that an unasked-for line means."""
    where = f"the gantry on {port}"
    after = _RECOVER.format(port=port)
    match message:
        case Refusal(code):
            return RefusedError(f"{where} refused a jog: {error_words(code)}; see to it, {after}")
        case AlarmMessage(code):
            return AlarmError(f"{where} stopped: {alarm_words(code)}; {_after(code, port)}")
        case Banner():
            return ResetError(
                f"{where} was reset while in use; its position may be lost: home it, {after}"
            )


def from_status(status: Status, port: str, stopping: bool) -> RigError | None:
    """The failure that a reported state means; None for a healthy one.

    ``stopping``: a cancel is under way, and plain Grbl shows it as a hold.
    """
    where, after = f"the gantry on {port}", _RECOVER.format(port=port)
    pins = f" (active inputs: {pin_words(status.pins)})" if status.pins else ""
    match status.state:
        case "Idle" | "Jog":
            return None
        case "Alarm":
            what = f"{where} is locked: {alarm_words(status.part)}{pins}"
            return AlarmError(f"{what}; {_after(status.part, port)}")
        case "Door":
            return HeldError(f"{where} holds: {door_words(status.part)}{pins}; close it, {after}")
        case "Hold":
            if stopping:
                return None
            return HeldError(f"{where} is in feed hold{pins}: release it, {after}")
        case "Home":
            return HeldError(f"{where} is homing: wait until it is done, {after}")
        case "Run" if stopping:
            return None
        case _:
            return HeldError(
                f"{where} is busy (state {status.state}): another program moves or tests it; "
                f"end that, {after}"
            )


def _after(alarm: int | None, port: str) -> str:
    return (_HOME if alarm in _LOST else _RECOVER).format(port=port)


def no_rest(status: Status, port: str) -> RigError:
    """It keeps moving after a cancel."""
    return GantryError(
        f"the gantry on {port} did not come to rest after a stop (state {status.state}): use the "
        "emergency stop, then find out which program moves it"
    )
