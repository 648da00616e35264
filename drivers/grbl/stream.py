"""Velocities to jog lines: short increments whose rounding errors never add up."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.grbl.controller import Controller

FloatArray = NDArray[np.float64]

_LONGEST_BLOCK_S = 0.050
# A block with fewer steps than this on its fastest axis would run at a ragged speed.
_STEPS_PER_BLOCK = 5.0
_PER_UNIT = 1000  # increments are sent to three decimals


@dataclass(frozen=True, slots=True)
class JogBlock:
    """One ``$J`` line and how long its motion takes."""

    line: bytes
    duration_s: float


class JogStream:
    """The path sent so far, and the next increment of it.

    ``target`` is where the motion should end by now; what is sent is its rounded value minus
    what was sent before, so the path stays within half a thousandth of the target for ever.
    """

    def __init__(self, controller: Controller, segment_s: float) -> None:
        self._letters = controller.letters
        self._steps = controller.steps_per_unit
        self._segment_s = segment_s
        self.target = np.zeros(len(self._letters))  # (n,) machine coordinates
        self._sent = np.zeros(len(self._letters), dtype=np.int64)
        self._silent_until_s = float("-inf")

    def resync(self, mpos: FloatArray) -> None:
        """Start anew from the measured machine position ``mpos`` (n,)."""
        self.target = mpos.copy()
        self._sent = np.rint(mpos * _PER_UNIT).astype(np.int64)
        self._silent_until_s = float("-inf")

    def duration_s(self, rates: FloatArray) -> float:
        """How long the next block at ``rates`` (n,), units per second, should last."""
        fastest = float(np.max(np.abs(rates) * self._steps))
        wanted = _STEPS_PER_BLOCK / max(fastest, 1e-9)
        return min(max(wanted, self._segment_s), max(_LONGEST_BLOCK_S, self._segment_s))

    def next(self, rates: FloatArray, t_s: float, least_s: float = 0.0) -> JogBlock | None:
        """The block that continues the path at ``rates`` (n,) units per second.

        It lasts ``least_s`` or longer.

        Returns None when there is nothing to send: at rest, or so slow that the increment
        rounds to nothing; the path then grows with time until it does not.
        """
        if not np.any(rates) or t_s < self._silent_until_s:
            return None
        duration_s = max(self.duration_s(rates), least_s)
        self.target = self.target + rates * duration_s
        step = np.rint(self.target * _PER_UNIT).astype(np.int64) - self._sent
        if not np.any(step):
            self._silent_until_s = t_s + duration_s
            return None
        self._sent += step
        words = "".join(
            f"{letter}{number / _PER_UNIT:.3f}"
            for letter, number in zip(self._letters, step, strict=True)
            if number
        )
        # $701=0: the feed is the norm over millimetres and degrees together.
        feed = float(np.linalg.norm(step / _PER_UNIT)) / duration_s * 60.0
        return JogBlock(f"$J=G91G21{words}F{feed:.1f}\n".encode(), duration_s)
