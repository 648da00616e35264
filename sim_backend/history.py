"""Where the gantry really was: joint positions and velocities of the last two minutes."""

import numpy as np
from numpy.typing import NDArray

from sim_backend.jit import jit

FloatArray = NDArray[np.float64]

_CAPACITY = 1 << 17  # 131 s of steps of 1 ms, 13 MB


class JointHistory:
    """A ring of equally spaced joint states, interpolated by cubics.

    Written by one thread at a time; safe to read meanwhile, because entries are only
    overwritten two minutes after they were written.
    """

    def __init__(self, start_s: float, step_s: float) -> None:
        self.start_s = start_s
        self.step_s = step_s
        self.count = 0  # entries ever written; entry n is true at start_s + n * step_s
        self._q = np.empty((_CAPACITY, 6))
        self._qd = np.empty((_CAPACITY, 6))

    def append(self, q: FloatArray, qd: FloatArray) -> None:
        """Record joint positions and velocities (6,) of the next instant."""
        i = self.count % _CAPACITY
        self._q[i] = q
        self._qd[i] = qd
        self.count += 1

    @property
    def first(self) -> int:
        """The number of the oldest entry still held."""
        return max(0, self.count - _CAPACITY)

    def time_s(self, n: int) -> float:
        """The instant of entry ``n``."""
        return self.start_s + n * self.step_s

    def entries(self, numbers: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """Joint positions and velocities (m, 6) each of the numbered entries."""
        i = numbers % _CAPACITY
        return self._q[i], self._qd[i]

    def at(self, t_s: float) -> tuple[FloatArray, FloatArray]:
        """Joint positions and velocities (6,) each at an instant inside the recorded span.

        Raises ValueError outside it (a step's worth of slack at both ends for rounding).
        """
        x = (t_s - self.start_s) / self.step_s
        if not self.first - 0.01 <= x <= self.count - 1 + 0.01:
            raise ValueError(
                f"t = {t_s:.6f} s lies outside the recorded motion, "
                f"{self.time_s(self.first):.6f} to {self.time_s(self.count - 1):.6f} s"
            )
        n = min(max(int(x), self.first), max(self.count - 2, 0))
        i, j = n % _CAPACITY, min(n + 1, self.count - 1) % _CAPACITY
        return hermite(self._q[i], self._qd[i], self._q[j], self._qd[j], x - n, self.step_s)


@jit
def hermite(
    q0: FloatArray, qd0: FloatArray, q1: FloatArray, qd1: FloatArray, x: float, step_s: float
) -> tuple[FloatArray, FloatArray]:
    """The cubic through both states, and its derivative, at the fraction ``x`` of the step."""
    x2, x3 = x * x, x * x * x
    q = (
        (2 * x3 - 3 * x2 + 1) * q0
        + (x3 - 2 * x2 + x) * step_s * qd0
        + (3 * x2 - 2 * x3) * q1
        + (x3 - x2) * step_s * qd1
    )
    qd = (6 * x2 - 6 * x) / step_s * (q0 - q1) + (3 * x2 - 4 * x + 1) * qd0 + (3 * x2 - 2 * x) * qd1
    return q, qd
