"""The firmware's look-ahead: a queue of straight blocks whose plan always ends at rest."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_backend.loopback_grbl.machine import Machine

FloatArray = NDArray[np.float64]

_JUNCTION_DEVIATION = 0.01  # $11, in the norm's units
_SHORTEST = 1e-9


@dataclass(slots=True)
class Block:
    """A straight move; lengths and speeds in the norm over all axes, mm and deg together."""

    end: FloatArray  # (axes,) machine coordinates
    direction: FloatArray  # (axes,) unit vector
    length: float
    speed: float  # wanted, units per second
    acceleration: float  # units per second²
    junction2: float  # square of the highest speed at its beginning


class Planner:
    """Blocks waiting to be cut into segments; the first one may be partly used up."""

    def __init__(self, machine: Machine) -> None:
        self._capacity = machine.planner_blocks
        self._max_speed = machine.column(machine.max_rate) / 60.0
        self._max_acceleration = machine.column(machine.acceleration)
        self._steps = machine.column(machine.steps_per_unit)
        self.blocks: deque[Block] = deque()
        self.left = 0.0  # length of the first block not cut yet
        self._last: Block | None = None
        self.position = np.zeros(machine.axes)  # where the queue ends, whole steps

    @property
    def free(self) -> int:
        """How many further blocks fit: the first number of ``Bf``."""
        return self._capacity - len(self.blocks)

    def clear(self, position: FloatArray) -> None:
        """Flush the queue; the next move starts at ``position`` (axes,), rounded to steps."""
        self.blocks.clear()
        self.left = 0.0
        self._last = None
        self.position = np.rint(position * self._steps) / self._steps

    def add(self, end: FloatArray, feed: float | None) -> bool:
        """Plan a move at ``feed`` units per minute (None: as fast as the axes may).

        Ends are rounded to whole steps. Returns False, planning nothing, when the move is
        shorter than a step on every axis; the missing part is made up by the next move.
        """
        rounded = np.rint(end * self._steps) / self._steps
        delta = rounded - self.position
        length = float(np.linalg.norm(delta))
        if length < _SHORTEST:
            return False
        direction = delta / length
        parts = np.maximum(np.abs(direction), 1e-12)
        fastest = float(np.min(self._max_speed / parts))
        acceleration = float(np.min(self._max_acceleration / parts))
        speed = fastest if feed is None else min(feed / 60.0, fastest)
        junction2 = 0.0
        if self.blocks and self._last is not None:
            junction2 = _junction2(self._last, direction, speed, acceleration)
        block = Block(rounded, direction, length, speed, acceleration, junction2)
        if not self.blocks:
            self.left = length
        self.blocks.append(block)
        self._last = block
        self.position = rounded
        return True

    def exit_speed(self) -> float:
        """The speed at the first block's end from which all that follows can still stop."""
        allowed2 = 0.0
        for i in range(len(self.blocks) - 1, 0, -1):
            block = self.blocks[i]
            allowed2 = min(block.junction2, allowed2 + 2.0 * block.acceleration * block.length)
        return math.sqrt(allowed2)

    def pop(self) -> None:
        """Go on to the next block."""
        self.blocks.popleft()
        self.left = self.blocks[0].length if self.blocks else 0.0


def _junction2(before: Block, direction: FloatArray, speed: float, acceleration: float) -> float:
    """Square of the speed through a corner, by Grbl's junction deviation."""
    slowest2 = min(before.speed, speed) ** 2
    cosine = -float(before.direction @ direction)
    if cosine > 0.999999:
        return 0.0  # straight back
    if cosine < -0.999999:
        return slowest2  # straight on
    sine_half = math.sqrt(0.5 * (1.0 - cosine))
    corner2 = min(acceleration, before.acceleration) * _JUNCTION_DEVIATION * sine_half
    return min(slowest2, corner2 / (1.0 - sine_half))
