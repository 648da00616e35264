"""The G-code that a velocity-streaming host uses, with Grbl's error numbers.

Known: G0 G1 G20 G21 G53 G90 G91 G93 G94, axis words, F, N. Everything else is refused with
error:20 (assumed: real firmware knows more). Numbers follow Grbl's published list.
"""

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

EXPECTED_LETTER = 1
BAD_NUMBER = 2
BAD_STATEMENT = 3
HOMING_DISABLED = 5
NOT_IDLE = 8
LOCKED = 9
LINE_TOO_LONG = 11
JOG_BEYOND_LIMITS = 15
BAD_JOG = 16
UNSUPPORTED = 20
SAME_GROUP_TWICE = 21
NO_FEED = 22
NO_AXIS_WORDS = 26
RESET_NEEDED = 79

_MM_PER_INCH = 25.4
_WORD = re.compile(r"([A-Z])([^A-Z]*)")
_GROUPS = {"G": {0: "motion", 1: "motion", 20: "units", 21: "units", 90: "distance"}}
_GROUPS["G"] |= {91: "distance", 93: "feed", 94: "feed", 53: "system"}


class GcodeError(Exception):
    """A line that the firmware answers with ``error:<code>``."""

    def __init__(self, code: int) -> None:
        super().__init__(f"error:{code}")
        self.code = code


@dataclass(slots=True)
class Modes:
    """The modal state that lines change."""

    motion: int = 0
    inches: bool = False
    relative: bool = False
    inverse_time: bool = False
    feed: float | None = None  # units per minute


@dataclass(frozen=True, slots=True)
class Move:
    """A motion to plan."""

    target: FloatArray  # (axes,) machine coordinates
    feed: float | None  # units per minute of the norm over all axes; None: rapid


def parse_words(line: str) -> list[tuple[str, float]]:
    """The words of a line; raises GcodeError with Grbl's code for a malformed one."""
    text = re.sub(r"\([^)]*\)|;.*", "", line).upper()
    text = re.sub(r"[ \t/]", "", text)
    if text and not text[0].isalpha():
        raise GcodeError(EXPECTED_LETTER)
    words = []
    for letter, number in _WORD.findall(text):
        if not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)", number) or len(number) > 30:
            raise GcodeError(BAD_NUMBER)
        words.append((letter, float(number)))
    return words


def parse_move(line: str, letters: str, modes: Modes, at: FloatArray, jog: bool) -> Move | None:
    """The motion that ``line`` asks for from position ``at``; None if it only sets modes.

    A jog leaves ``modes`` alone and neither allows G0, G1 nor G93, and must bring its own F.
    Raises GcodeError.
    """
    new = Modes(modes.motion, modes.inches, modes.relative, modes.inverse_time, modes.feed)
    if jog:
        # A jog knows G94 only and inherits units and distance mode, but no feed.
        new.inverse_time, new.feed = False, None
    axis_words: dict[int, float] = {}
    used: set[str] = set()
    for letter, value in parse_words(line):
        if letter == "G":
            _apply_g(value, new, used, jog)
        elif letter == "F":
            new.feed = value
        elif letter in letters:
            axis_words[letters.index(letter)] = value
        elif letter != "N":
            raise GcodeError(UNSUPPORTED)
    return _finish(new, modes, axis_words, at, jog)


def _apply_g(value: float, new: Modes, used: set[str], jog: bool) -> None:
    group = _GROUPS["G"].get(int(value)) if value == int(value) else None
    if group is None:
        raise GcodeError(UNSUPPORTED)
    if group in used:
        raise GcodeError(SAME_GROUP_TWICE)
    used.add(group)
    code = int(value)
    if group == "motion":
        if jog:
            raise GcodeError(BAD_JOG)
        new.motion = code
    elif group == "units":
        new.inches = code == 20
    elif group == "distance":
        new.relative = code == 91
    elif group == "feed":
        if jog and code == 93:
            raise GcodeError(BAD_JOG)
        new.inverse_time = code == 93


def _finish(
    new: Modes, modes: Modes, axis_words: dict[int, float], at: FloatArray, jog: bool
) -> Move | None:
    scale = _MM_PER_INCH if new.inches else 1.0
    if jog and not axis_words:
        raise GcodeError(NO_AXIS_WORDS)
    if not axis_words:
        _keep(new, modes)
        return None
    if (jog or new.motion == 1) and not new.feed:
        raise GcodeError(NO_FEED)
    target = at.copy()
    for axis, value in axis_words.items():
        target[axis] = value * scale + (at[axis] if new.relative else 0.0)
    feed = None if new.feed is None else new.feed * scale
    if not jog:
        _keep(new, modes)
        if new.inverse_time:
            feed = float(np.linalg.norm(target - at)) * (new.feed or 0.0)
        if new.motion == 0:
            feed = None
    if feed is not None and not (feed > 0.0 and math.isfinite(feed)):
        raise GcodeError(NO_FEED)
    return Move(target, feed)


def _keep(new: Modes, modes: Modes) -> None:
    for name in ("motion", "inches", "relative", "inverse_time", "feed"):
        setattr(modes, name, getattr(new, name))
