"""The gantry's true motion for a camera simulated in another process, through shared memory.

The file has no name: nothing is left behind however the processes end. No lock: rows are
filled before the count is raised, and overwritten only ``CAPACITY`` rows later.
"""

import mmap
import os

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from sim_backend.history import JointHistory
from sim_backend.world import World

FloatArray = NDArray[np.float64]

CAPACITY = 1 << 13  # 8 s of steps of 1 ms
_GUARD = 1 << 11  # rows this close to being overwritten are not read
_HEADER = 8  # doubles: count, start, step
_WIDTH = 12  # positions and velocities
_SIZE_BYTES = 8 * (_HEADER + CAPACITY * _WIDTH)
_WAIT_S = 1e-3


class _Rows:
    """The layout that both ends map."""

    def __init__(self, file: int) -> None:
        values = np.frombuffer(mmap.mmap(file, _SIZE_BYTES), dtype=np.float64)
        self.header = values[:_HEADER]
        self.rows = values[_HEADER:].reshape(CAPACITY, _WIDTH)


class MotionFeed:
    """The writing end: shows the motion of ``world`` to whoever has ``file`` open."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.file = os.memfd_create("joint-motion", os.MFD_CLOEXEC)
        os.ftruncate(self.file, _SIZE_BYTES)
        self._shared = _Rows(self.file)
        self._history: JointHistory | None = None
        self._count = 0
        self.publish()

    def publish(self) -> None:
        """Show what happened up to the present."""
        self._world.sync()
        history, count = self._world.history, self._world.history.count
        if history is not self._history:  # the first one, or one begun anew
            self._history, self._count = history, 0
            self._shared.header[:3] = 0, history.start_s, history.step_s
        numbers = np.arange(max(self._count, count - CAPACITY), count)
        q, qd = history.entries(numbers)
        self._shared.rows[numbers % CAPACITY] = np.hstack([q, qd])
        self._shared.header[0] = count
        self._count = count

    def close(self) -> None:
        """Let go of the file; readers keep what they have mapped."""
        if self.file >= 0:
            os.close(self.file)
            self.file = -1


class SharedMotion:
    """The reading end: a ``MotionSource``."""

    def __init__(self, file: int, clock: Clock) -> None:
        """Maps ``file``, which stays the caller's to close."""
        self._shared = _Rows(file)
        self._clock = clock

    def motion(self, since_s: float) -> FloatArray:
        """Rows (t_s, q (6), qd (6)), equally spaced, at and after an instant.

        Waits a moment where there is none yet, so that whoever asks again does not spin.
        """
        rows = self._since(since_s)
        if len(rows) == 0:
            self._clock.sleep_until(self._clock.now_s() + _WAIT_S)
            rows = self._since(since_s)
        return rows

    def _since(self, since_s: float) -> FloatArray:
        count, start_s, step_s = self._shared.header[:3]
        oldest = max(0, int(count) - (CAPACITY - _GUARD))
        first = max(oldest, int(np.ceil((since_s - start_s) / step_s)))
        numbers = np.arange(first, int(count))
        rows = self._shared.rows[numbers % CAPACITY]
        return np.column_stack([start_s + numbers * step_s, rows])
