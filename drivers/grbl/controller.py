"""What the driver learned about the controller when it connected."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_BITS_PER_BYTE = 10.0
_LINE_HEAD_BYTES, _AXIS_BYTES = 17, 7  # of a jog line, typically
_LONGEST_HEAD_BYTES, _LONGEST_AXIS_BYTES = 20, 9
# The share of the line that jogs may take; acknowledgements and reports need no room on it.
_LINE_SHARE = 0.4
_FAST_S, _SLOW_S = 0.010, 0.020
_FAST_BLOCKS, _SLOW_BLOCKS = 4, 3


@dataclass(frozen=True, slots=True)
class Controller:
    """A connected controller; arrays hold the configured axes in the configured order."""

    banner: str
    letters: tuple[str, ...]
    columns: tuple[int, ...]  # where each axis stands in a status report
    steps_per_unit: FloatArray  # (n,)
    max_rate: FloatArray  # (n,) units per second
    acceleration: FloatArray  # (n,) units per second²
    mpos: FloatArray  # (n,) machine coordinates at the end of the set-up
    planner_blocks: int
    rx_bytes: int  # of its receive buffer; what overflows it on a bare UART is lost
    round_trips_s: tuple[float, ...]  # of status requests, while at rest
    notes: tuple[str, ...]  # what could not be verified, for the user

    def pick(self, position: tuple[float, ...]) -> FloatArray:
        """The configured axes (n,) of a reported position; raises IndexError if one lacks."""
        return np.array([position[column] for column in self.columns])


def longest_line_bytes(axes: int) -> int:
    """No jog line is longer than this."""
    return _LONGEST_HEAD_BYTES + _LONGEST_AXIS_BYTES * axes


def segment_s(baud: int, axes: int) -> float:
    """The block duration that the line can carry: 10 ms, or 20 ms where that saturates it."""
    line_s = (_LINE_HEAD_BYTES + _AXIS_BYTES * axes) * _BITS_PER_BYTE / baud
    return _FAST_S if line_s <= _LINE_SHARE * _FAST_S else _SLOW_S


def lookahead_blocks(duration_s: float) -> int:
    """How many blocks to keep planned ahead: fewer starve, more only add delay."""
    return _FAST_BLOCKS if duration_s <= _FAST_S else _SLOW_BLOCKS
