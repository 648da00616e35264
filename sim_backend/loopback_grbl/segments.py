"""Cutting the plan into the 10 ms segments of constant speed that drive the motors."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_backend.loopback_grbl.planner import Block, Planner

FloatArray = NDArray[np.float64]

SEGMENT_S = 0.010
_TINY_S = 1e-7
_TINY = 1e-9


@dataclass(frozen=True, slots=True)
class Segment:
    """A stretch at constant velocity, on the firmware's own time."""

    start_s: float
    end_s: float
    start: FloatArray  # (axes,) machine coordinates
    end: FloatArray
    speed_after: float  # of the plan at its end, in the norm's units per second
    direction: FloatArray  # (axes,) unit vector
    acceleration: float

    def position(self, t_s: float) -> FloatArray:
        """Where the axes are at an instant inside the segment."""
        share = (t_s - self.start_s) / (self.end_s - self.start_s)
        between: FloatArray = self.start + min(max(share, 0.0), 1.0) * (self.end - self.start)
        return between

    @property
    def velocity(self) -> FloatArray:
        """Axis velocities in units per second."""
        rate: FloatArray = (self.end - self.start) / (self.end_s - self.start_s)
        return rate


class Cutter:
    """Turns the planner's blocks into segments; what is cut can no longer be replanned."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self.speed = 0.0  # of the plan where the last segment ends
        self.holding = False  # decelerating to rest whatever the plan says

    def cut(self, start_s: float) -> Segment | None:
        """The next segment of at most 10 ms, ending at a block's end at the latest.

        Returns None when there is nothing to cut or a hold has come to rest.
        """
        planner = self._planner
        if not planner.blocks or (self.holding and self.speed < _TINY):
            return None
        block = planner.blocks[0]
        start = block.end - block.direction * planner.left
        exit_speed = 0.0 if self.holding else planner.exit_speed()
        used_s = self._run(block, exit_speed)
        if planner.left <= _TINY:
            planner.left = 0.0
        end = block.end - block.direction * planner.left
        segment = Segment(
            start_s, start_s + used_s, start, end, self.speed, block.direction, block.acceleration
        )
        if planner.left == 0.0:
            planner.pop()
        return segment

    def _run(self, block: Block, exit_speed: float) -> float:
        """Advance along the block by up to one segment; returns the time it takes."""
        planner, rest_s = self._planner, SEGMENT_S
        while rest_s > _TINY_S and planner.left > _TINY:
            speed = self.speed
            target, span_s = self._phase(block, exit_speed)
            span_s = min(span_s, rest_s)
            if target != speed:
                change = math.copysign(block.acceleration * span_s, target - speed)
                after = min(target, speed + change) if change > 0 else max(target, speed + change)
            else:
                after = speed
            length = 0.5 * (speed + after) * span_s
            if length >= planner.left:
                # The block ends inside this phase; its mean speed is close enough for the time.
                span_s *= planner.left / length
                length = planner.left
            planner.left -= length
            self.speed = after
            rest_s -= span_s
            if after < _TINY:
                self.speed = 0.0
                if not self.holding:
                    planner.left = 0.0  # rounding left a hair of way and no speed
                break
        return max(SEGMENT_S - rest_s, _TINY_S)

    def _phase(self, block: Block, exit_speed: float) -> tuple[float, float]:
        """The speed to go for now, and how long until that, or the next phase, is reached."""
        speed, a, left = self.speed, block.acceleration, self._planner.left
        if self.holding:
            return 0.0, max(speed / a, _TINY_S)
        braking = max(speed * speed - exit_speed * exit_speed, 0.0) / (2.0 * a)
        if speed > block.speed + _TINY:
            return block.speed, (speed - block.speed) / a
        if speed > exit_speed and left <= braking + _TINY:
            return exit_speed, max((speed - exit_speed) / a, _TINY_S)
        peak = math.sqrt(0.5 * (2.0 * a * left + speed * speed + exit_speed * exit_speed))
        top = min(block.speed, max(peak, exit_speed))
        if speed < top - _TINY:
            return top, (top - speed) / a
        cruise = max(left - braking, _TINY)
        return speed, cruise / max(speed, _TINY)
