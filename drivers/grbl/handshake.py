"""Finding out what is on the port, and refusing a controller that would move wrongly."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from drivers.clock import Clock
from drivers.errors import ConnectError
from drivers.grbl import faults
from drivers.grbl.controller import Controller
from drivers.grbl.errors import NotReadyError
from drivers.grbl.link import Link
from drivers.grbl.protocol import Info, LineReader, Message, Ok, Refusal, Setting, Status
from drivers.grbl.protocol import parse as parse_line
from drivers.grbl.settings import AxisSettings, GrblSettings, standard_axes

_LOOK_S = 0.005
_ASK_EVERY_S = 0.25
_ANSWER_S = 2.0
_ROUND_TRIPS = 10
_ROUND_TRIP_WAIT_S = 0.1
_SPACING_S = 0.010  # controllers answer 160 times per second at most
_LETTERS = "XYZABC"
_DEAF = ("Hold", "Door", "Home", "Sleep")  # states in which no line is read


@dataclass(slots=True)
class Conversation:
    """Request and answer over a link, for set-up only; the stream has its own way."""

    link: Link
    clock: Clock
    settings: GrblSettings
    _reader: LineReader = field(init=False)

    def __post_init__(self) -> None:
        self._reader = LineReader(self.settings.baud)

    def listen(self, wait_s: float, done: Callable[[Message], bool]) -> list[Message]:
        """Messages until one is ``done``, or for ``wait_s``."""
        heard: list[Message] = []
        deadline_s = self.clock.now_s() + wait_s
        while self.clock.now_s() < deadline_s:
            data = self.link.read(_LOOK_S)
            lines = self._reader.feed(data, self.clock.now_s())
            heard += [parse_line(line.text) for line in lines]
            for i, message in enumerate(heard):
                if done(message):
                    return heard[: i + 1]
        return heard

    def ask(self, line: str, wait_s: float = _ANSWER_S) -> list[Message]:
        """Send a line and return everything up to its ``ok`` or error.

        Raises ConnectError when neither comes.
        """
        self.link.write(line.encode() + b"\n")
        heard = self.listen(wait_s, lambda message: isinstance(message, Ok | Refusal))
        if not heard or not isinstance(heard[-1], Ok | Refusal):
            raise ConnectError(
                f"the controller on {self.settings.port} did not answer {line!r}: check that "
                "nothing else uses the port, and that it is a Grbl or grblHAL board"
            )
        return heard

    def status(self, wait_s: float, every_s: float = _ASK_EVERY_S) -> Status | None:
        """A status report, asked for again and again: now and then a request gets no answer."""
        deadline_s = self.clock.now_s() + wait_s
        while self.clock.now_s() < deadline_s:
            self.link.write(b"?")
            heard = self.listen(every_s, lambda message: isinstance(message, Status))
            if heard and isinstance(heard[-1], Status):
                return heard[-1]
        return None


def introduce(
    link: Link, clock: Clock, settings: GrblSettings
) -> tuple[Controller, tuple[AxisSettings, ...]]:
    """Ask the controller who it is; returns that and the axes to use.

    Raises ConnectError for a controller that does not answer, lacks an axis or would misread
    feeds, NotReadyError for one that must be recovered before it answers. One that is merely
    locked is no error here: its states will say so.
    """
    talk = Conversation(link, clock, settings)
    status = talk.status(settings.boot_timeout_s)
    if status is None:
        raise ConnectError(
            f"nothing that speaks Grbl answers on {settings.port} at {settings.baud} baud: check "
            "the port, the baud rate and the power"
        )
    if status.state == "Jog":
        # Left over from somebody who was killed: what it queued is still running.
        link.write(b"\x85")
    status = _complete(talk, status)
    if status.state in _DEAF:
        raise _not_ready(status, settings.port)
    talk.ask("")  # ends a sticky error and whatever half line was in the buffer
    answer = talk.ask("$I")
    if isinstance(answer[-1], Refusal):
        raise _not_ready(status, settings.port)
    infos = {m.key: m.text for m in answer if isinstance(m, Info)}
    values = {m.number: m.value for m in talk.ask("$$") if isinstance(m, Setting)}
    letters = _axis_letters(infos, status)
    axes = settings.axes or standard_axes(min(len(letters), len(_LETTERS)))
    notes = _checked(values, infos, settings.port)
    return _controller(talk, axes, letters, infos, values, notes), axes


def _not_ready(status: Status, port: str) -> NotReadyError:
    why = faults.from_status(status, port, stopping=False)
    text = str(why) if why else f"the gantry on {port} must be reset before use"
    return NotReadyError(text, status)


def _complete(talk: Conversation, status: Status) -> Status:
    if status.position is None or status.blocks_free is None:
        raise ConnectError(
            f"the controller on {talk.settings.port} reports no machine position or no buffer "
            "state: type `$10=511` (grblHAL) or `$10=3` (plain Grbl) into a terminal once"
        )
    return status


def _axis_letters(infos: dict[str, str], status: Status) -> str:
    """The controller's axes: by name where it says so, else by count, in the usual order."""
    match = re.fullmatch(r"(\d+):([A-Z]+)", infos.get("AXS", ""))
    if match is not None:
        return match[2]
    return _LETTERS[: len(status.position or ())]


def _checked(values: dict[int, str], infos: dict[str, str], port: str) -> list[str]:
    """What could not be verified; raises ConnectError on what is wrong."""
    if _number(values.get(13, "0")) not in (0.0, None):
        raise ConnectError(f"the controller on {port} reports inches: type `$13=0` once")
    if 701 in values:
        if _number(values[701]) != 0.0:
            raise ConnectError(
                f"the controller on {port} leaves rotary axes out of the feed (or in otherwise "
                f"than assumed, $701={values[701]}): type `$701=0` once"
            )
        return []
    if "grblHAL" in infos.get("FIRMWARE", ""):
        return ["$701 is unknown to this grblHAL: that rotary axes count in the feed is assumed"]
    return []


def _controller(
    talk: Conversation,
    axes: tuple[AxisSettings, ...],
    letters: str,
    infos: dict[str, str],
    values: dict[int, str],
    notes: list[str],
) -> Controller:
    missing = [axis.letter for axis in axes if axis.letter not in letters]
    if missing:
        raise ConnectError(
            f"the controller on {talk.settings.port} has the axes {letters}, but the configuration "
            f"uses {', '.join(missing)}: correct arm.axes"
        )
    columns = tuple(letters.index(axis.letter) for axis in axes)
    found = {base: _column(values, base, columns, talk.settings.port) for base in (100, 110, 120)}
    round_trips_s, reports = _round_trips(talk)
    position = reports[-1].position or ()
    return Controller(
        banner=infos.get("VER", "") + " " + infos.get("FIRMWARE", "Grbl"),
        letters=tuple(axis.letter for axis in axes),
        columns=columns,
        steps_per_unit=found[100],
        max_rate=found[110] / 60.0,
        acceleration=found[120],
        mpos=np.array([position[column] for column in columns]),
        planner_blocks=max(report.blocks_free or 0 for report in reports),
        rx_bytes=max(report.bytes_free or 0 for report in reports),
        round_trips_s=round_trips_s,
        notes=tuple(notes),
    )


def _column(
    values: dict[int, str], base: int, columns: tuple[int, ...], port: str
) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    numbers = [_number(values.get(base + column, "")) for column in columns]
    if any(number is None or number <= 0.0 for number in numbers):
        raise ConnectError(
            f"the controller on {port} lists no usable ${base}... in `$$`: is it a Grbl or "
            "grblHAL board, and are its axes set up?"
        )
    return np.array(numbers, dtype=float)


def _round_trips(talk: Conversation) -> tuple[tuple[float, ...], list[Status]]:
    """Times of status requests at rest, and the complete reports they brought."""
    times_s: list[float] = []
    reports: list[Status] = []
    for _ in range(_ROUND_TRIPS):
        talk.listen(_SPACING_S, lambda message: False)
        begun_s = talk.clock.now_s()
        talk.link.write(b"?")
        heard = talk.listen(_ROUND_TRIP_WAIT_S, lambda message: isinstance(message, Status))
        if heard and isinstance(heard[-1], Status) and heard[-1].position is not None:
            times_s.append(talk.clock.now_s() - begun_s)
            reports.append(heard[-1])
    if not reports:
        raise ConnectError(f"the controller on {talk.settings.port} stopped answering")
    return tuple(times_s), reports


def _number(text: str) -> float | None:
    return float(text) if re.fullmatch(r"-?\d{1,9}(\.\d{0,9})?", text.strip(), re.ASCII) else None
