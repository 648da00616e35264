"""Stopping a gantry whoever set it moving, and seeing to it that it stands still."""

import contextlib
from collections.abc import Callable

import numpy as np

from drivers.clock import Clock
from drivers.errors import DeviceTimeoutError, OperateError
from drivers.grbl.errors import GantryError, PortLostError
from drivers.grbl.handshake import Conversation
from drivers.grbl.link import Link
from drivers.grbl.protocol import Banner, Status
from drivers.grbl.settings import GrblSettings

_JOG_CANCEL = b"\x85"
_FEED_HOLD = b"!"
_RESET = b"\x18"

_STATUS_S = 1.0
_ASK_EVERY_S = 0.05  # while it may be moving
_AGAIN_S = 0.15  # a line that was on its way may follow the cancel
_HEEDED_S = 0.5  # a programme that still runs so long after a feed hold ignores it
_REST_S = 0.15  # between two reports that must agree on the position
_BANNER_S = 3.0
_TRIES = 3
_BRAKING = {("Hold", 1), ("Door", 2), ("Door", 3)}


def stop_motion(link: Link, clock: Clock, settings: GrblSettings) -> str:
    """Bring the gantry to rest and drop what it still had to do; says what was done.

    A jog is cancelled and a programme held, which both brake; a reset, which does not, ends
    homing, what is held, and what does not heed the other two. Nothing can resume afterwards.
    Raises OperateError, naming the state and the emergency stop, unless two reports then agree
    that nothing moves.
    """
    talk = Conversation(link, clock, settings)
    where = f"the gantry on {settings.port}"
    try:
        last = talk.status(settings.boot_timeout_s, _ASK_EVERY_S)
        done: list[str] = []
        for _ in range(_TRIES):
            if last is None:
                raise _silent(link, where)
            done += _brake(talk, last)
            last, rests = _look(talk)
            if last is not None and rests:
                return f"{where} stands still: {_words(done, last, settings.port)}"
    except PortLostError as error:
        raise PortLostError(
            f"{error}. Whether the gantry stands still is not known: use the emergency stop"
        ) from error
    state = "silence" if last is None else last.state
    raise GantryError(f"{where} did not come to rest (state {state}): use the emergency stop")


def _brake(talk: Conversation, status: Status) -> list[str]:
    """What the state takes to end it, the gentle way first; says what that was."""
    done = []
    latest: Status | None = status
    if status.state == "Jog":
        latest = _order(talk, _JOG_CANCEL, status, _jogs)
        done.append("its jog was cancelled")
    elif status.state == "Run":
        latest = _order(talk, _FEED_HOLD, status, _runs)
        done.append("its program was held")
    elif status.state in ("Hold", "Door"):
        latest = _order(talk, _FEED_HOLD, status, _runs)
    if latest is None or latest.state not in ("Idle", "Alarm"):
        talk.link.write(_RESET)
        talk.listen(_BANNER_S, lambda message: isinstance(message, Banner))
        state = status.state if latest is None else latest.state
        done.append(f"a reset ended its state {state} and dropped what was left to do")
    return done


def _order(
    talk: Conversation, order: bytes, status: Status, going_on: Callable[[Status, float], bool]
) -> Status | None:
    """Give an order, again and again, while a state goes on; the last report."""
    latest: Status | None = status
    begun_s = talk.clock.now_s()
    while latest is not None and going_on(latest, talk.clock.now_s() - begun_s):
        if talk.clock.now_s() - begun_s > talk.settings.rest_timeout_s:
            break
        talk.link.write(order)
        talk.listen(_AGAIN_S, lambda message: False)
        latest = talk.status(_STATUS_S, _ASK_EVERY_S)
    return latest


def _jogs(status: Status, passed_s: float) -> bool:
    # Plain Grbl shows a jog that is being cancelled as a hold.
    return status.state == "Jog" or (status.state, status.part) in _BRAKING


def _runs(status: Status, passed_s: float) -> bool:
    running = status.state == "Run" and passed_s < _HEEDED_S
    return running or (status.state, status.part) in _BRAKING


def _look(talk: Conversation) -> tuple[Status | None, bool]:
    """The newest report, and whether two of them agree that nothing moves."""
    first = talk.status(_STATUS_S, _ASK_EVERY_S)
    talk.listen(_REST_S, lambda message: False)
    second = talk.status(_STATUS_S, _ASK_EVERY_S)
    if first is None or second is None:
        return second, False
    moving = second.state in ("Jog", "Run", "Home") or (second.state, second.part) in _BRAKING
    return second, not moving and _same_place(first, second)


def _same_place(first: Status, second: Status) -> bool:
    """Where the reports carry no machine position the state alone has to do."""
    if first.position is None or second.position is None:
        return True
    return np.array_equal(first.position, second.position)


def _silent(link: Link, where: str) -> OperateError:
    """Stop it blindly: what cannot be heard may hear."""
    with contextlib.suppress(PortLostError):
        link.write(_JOG_CANCEL + _FEED_HOLD + _RESET)
    return DeviceTimeoutError(
        f"{where} does not answer. It was sent a reset, but whether it stands still is not known: "
        "use the emergency stop"
    )


def _words(done: list[str], last: Status, port: str) -> str:
    text = ", ".join(dict.fromkeys(done)) or "it did already"
    if last.state != "Alarm":
        return text
    return f"{text}. It is locked: `rig arm home --arm grbl --port {port}`, or `rig arm recover`"
