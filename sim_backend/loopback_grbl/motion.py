"""What the motors do: segments committed ahead of time, and the three ways to stop them."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.planner import Planner
from sim_backend.loopback_grbl.segments import SEGMENT_S, Cutter, Segment

FloatArray = NDArray[np.float64]

_COMMITTED = 10  # segments: the one that runs and nine behind it
# A jog cancel drops the segments that begin later than this after it took effect. Fitted to
# the measured stopping distances (2.5 mm from 50 mm/s, 24.9 mm from 200 mm/s).
_CANCEL_KEEPS_S = 0.014


class Motion:
    """The gantry's axes on the firmware's own time; positions in machine coordinates (axes,)."""

    def __init__(self, machine: Machine, position: FloatArray) -> None:
        self._steps = machine.column(machine.steps_per_unit)
        self.planner = Planner(machine)
        self._cutter = Cutter(self.planner)
        self._segments: deque[Segment] = deque()
        self._rest = position.copy()  # where the axes are when no segment runs
        self.planner.clear(position)

    @property
    def moving(self) -> bool:
        """Whether segments are left to run."""
        return bool(self._segments)

    @property
    def at_rest(self) -> bool:
        """Whether everything planned has been done, or a hold has come to rest."""
        return not self._segments and (self._cutter.holding or not self.planner.blocks)

    @property
    def prepared_speed(self) -> float:
        """Units per second of the segment prepared last: it leads the motion (``FS``)."""
        if not self._segments:
            return 0.0
        return float(np.linalg.norm(self._segments[-1].velocity))

    def advance(self, t_s: float) -> None:
        """Finish the segments that end by ``t_s`` and commit new ones."""
        while True:
            while self._segments and self._segments[0].end_s <= t_s:
                self._rest = self._segments.popleft().end
            if len(self._segments) >= _COMMITTED:
                return
            start_s = self._segments[-1].end_s if self._segments else t_s
            segment = self._cutter.cut(start_s)
            if segment is None:
                if not self._segments and not self._cutter.holding:
                    self._cutter.speed = 0.0
                return
            self._segments.append(segment)

    def state(self, t_s: float) -> tuple[FloatArray, FloatArray]:
        """Position (axes,) and velocity (axes,) in units and units per second at ``t_s``."""
        for segment in self._segments:
            if t_s < segment.end_s:
                return segment.position(t_s), segment.velocity
        return self._rest, np.zeros_like(self._rest)

    def counted(self, t_s: float) -> FloatArray:
        """Position (axes,) as the step counters know it."""
        steps: FloatArray = np.rint(self.state(t_s)[0] * self._steps)
        return steps / self._steps

    def hold(self) -> None:
        """Decelerate after the committed segments, keeping the queue (feed hold)."""
        self._cutter.holding = True

    def resume(self) -> None:
        """Go on with the queue after a hold."""
        self._cutter.holding = False
        self._cutter.speed = 0.0

    def cancel(self, t_s: float) -> None:
        """Decelerate soon and flush the queue (jog cancel).

        Assumed: the path ends in a straight line along the last segment kept.
        """
        keep_until_s = t_s + _CANCEL_KEEPS_S
        while len(self._segments) > 1 and self._segments[-1].start_s > keep_until_s:
            self._segments.pop()
        if not self._segments:
            self.planner.clear(self._rest)
            return
        last = self._segments[-1]
        speed, end_s, at = last.speed_after, last.end_s, last.end
        while speed > 0.0:
            span_s = min(SEGMENT_S, speed / last.acceleration)
            after = speed - last.acceleration * span_s
            after = after if after > 1e-6 else 0.0
            way = 0.5 * (speed + after) * span_s * last.direction
            self._segments.append(Segment(end_s, end_s + span_s, at, at + way, after, *_path(last)))
            speed, end_s, at = after, end_s + span_s, at + way
        self._cutter.speed = 0.0
        self._cutter.holding = False
        self.planner.clear(at)

    def kill(self, t_s: float) -> None:
        """Stop the step pulses at once (reset, hard limit).

        Assumed: the axes stand where the counters say; real motors lose steps at speed.
        """
        self._rest = self.counted(t_s)
        self._segments.clear()
        self._cutter.speed, self._cutter.holding = 0.0, False
        self.planner.clear(self._rest)


def _path(segment: Segment) -> tuple[FloatArray, float]:
    return segment.direction, segment.acceleration
