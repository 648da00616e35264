"""The controller's side of the protocol: bytes to typed messages. Never raises on any input."""

import math
import re
from dataclasses import dataclass

_LONGEST_LINE = 1024
_MOST_AXES = 8


@dataclass(frozen=True, slots=True)
class Ok:
    """A line was taken: planned, not executed."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """``error:<code>``; code 0 where the number cannot be read."""

    code: int


@dataclass(frozen=True, slots=True)
class AlarmMessage:
    """``ALARM:<code>``."""

    code: int


@dataclass(frozen=True, slots=True)
class Banner:
    """The controller has been reset."""

    text: str


@dataclass(frozen=True, slots=True)
class Setting:
    """``$<number>=<value>``."""

    number: int
    value: str


@dataclass(frozen=True, slots=True)
class Info:
    """``[KEY:text]``."""

    key: str
    text: str


@dataclass(frozen=True, slots=True)
class Status:
    """The answer to ``?``; fields that a report does not carry are None."""

    state: str
    part: int | None  # Hold:0, Door:1, Alarm:3
    position: tuple[float, ...] | None  # machine coordinates, mm and deg
    blocks_free: int | None
    bytes_free: int | None
    pins: str
    homed: bool | None = None  # grblHAL says it now and then


@dataclass(frozen=True, slots=True)
class Unknown:
    """Anything else: line noise, or a message this driver does not use."""

    text: str


Message = Ok | Refusal | AlarmMessage | Banner | Setting | Info | Status | Unknown


def parse(line: str) -> Message:
    """The message in one line without its end."""
    text = line.strip()
    if text == "ok":
        return Ok()
    if match := re.fullmatch(r"error:(.*)", text):
        return Refusal(_whole(match[1]) or 0)
    if match := re.fullmatch(r"ALARM:(.*)", text):
        return AlarmMessage(_whole(match[1]) or 0)
    # The end of the banner is enough: its beginning may have been lost in a reset.
    if re.search(r"(?i)grbl(hal)? \d.*\[.*help\]?$", text):
        return Banner(text)
    if match := re.fullmatch(r"\$(\d{1,5})=(.*)", text, re.ASCII):
        return Setting(int(match[1]), match[2])
    if match := re.fullmatch(r"\[([A-Z0-9 ]+):(.*)\]", text):
        return Info(match[1], match[2])
    if text.startswith("<") and text.endswith(">"):
        return _status(text[1:-1]) or Unknown(text)
    return Unknown(text)


def _status(text: str) -> Status | None:
    head, *fields = text.split("|")
    match = re.fullmatch(r"([A-Z][a-z]+)(?::(\d{1,3}))?", head, re.ASCII)
    if match is None:
        return None
    values: dict[str, str] = {}
    for field in fields:
        key, _, value = field.partition(":")
        values[key] = value
    position = _floats(values["MPos"]) if "MPos" in values else None
    if "MPos" in values and position is None:
        return None  # damaged: a report without its position is worth nothing
    blocks, _, free = values.get("Bf", "").partition(",")
    part = None if match[2] is None else int(match[2])
    homed = {"0": False, "1": True}.get(values.get("H", "").partition(",")[0])
    return Status(
        match[1], part, position, _whole(blocks), _whole(free), values.get("Pn", ""), homed
    )


def _whole(text: str) -> int | None:
    return int(text) if re.fullmatch(r"\d{1,6}", text, re.ASCII) else None


def _floats(text: str) -> tuple[float, ...] | None:
    parts = text.split(",")
    if len(parts) > _MOST_AXES:
        return None
    if not all(re.fullmatch(r"[+-]?\d{1,9}(\.\d{0,9})?", part, re.ASCII) for part in parts):
        return None
    values = tuple(float(part) for part in parts)
    return values if all(math.isfinite(value) for value in values) else None


@dataclass(frozen=True, slots=True)
class Line:
    """A received line and when it was on the wire."""

    text: str
    begun_s: float  # when its first bit left the controller
    bytes: int


class LineReader:
    """Cuts the byte stream into lines, each with the instant at which it began to be sent."""

    def __init__(self, baud: int) -> None:
        self._byte_s = 10.0 / baud
        self._rest = bytearray()
        self._overlong = False

    def feed(self, data: bytes, t_rx_s: float) -> list[Line]:
        """The lines completed by ``data``, whose last byte arrived at ``t_rx_s``."""
        lines: list[Line] = []
        start = 0
        while (end := data.find(b"\n", start)) >= 0:
            self._rest += data[start : end + 1]
            start = end + 1
            after = len(data) - start
            count = len(self._rest)
            if not self._overlong:
                begun_s = t_rx_s - (after + count) * self._byte_s
                text = self._rest.decode("ascii", "replace").strip()
                lines.append(Line(text, begun_s, count))
            self._rest.clear()
            self._overlong = False
        self._rest += data[start:]
        if len(self._rest) > _LONGEST_LINE:
            # Without a line end in sight this is noise: drop it up to the next one.
            self._rest.clear()
            self._overlong = True
        return lines

    def clear(self) -> None:
        """Forget a line begun."""
        self._rest.clear()
        self._overlong = False
