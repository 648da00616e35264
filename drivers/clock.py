"""The clock as a parameter: the only module that imports ``time``."""

import time
from typing import Protocol


class Clock(Protocol):
    """Monotonic seconds; the origin is arbitrary but fixed for the clock's life."""

    def now_s(self) -> float:
        """The present instant."""
        ...

    def sleep_until(self, t_s: float) -> None:
        """Return at ``t_s`` or as soon after as possible; at once if it has passed."""
        ...


class WallClock:
    """The machine's monotonic clock (CLOCK_MONOTONIC, the one kernel camera stamps use)."""

    # Sleeping wakes late by the kernel's timer slack; the rest is spun, never more than this.
    _SPIN_S = 200e-6

    def now_s(self) -> float:
        """Seconds of CLOCK_MONOTONIC."""
        return time.monotonic()

    def sleep_until(self, t_s: float) -> None:
        """Sleep to just before ``t_s`` and spin the last 0.2 ms."""
        remaining_s = t_s - time.monotonic()
        if remaining_s > self._SPIN_S:
            time.sleep(remaining_s - self._SPIN_S)
        while time.monotonic() < t_s:
            pass


def thread_cpu_time_s() -> float:
    """Processor seconds spent by the calling thread, for measuring cost (never for control)."""
    return time.thread_time()


def time_of_day_offset_ns() -> int:
    """What to add to ``WallClock`` for nanoseconds since 1970, as it is now."""
    return time.time_ns() - time.monotonic_ns()


def local_timestamp() -> str:
    """The local date and time as ``YYYYmmdd-HHMMSS``, for naming directories."""
    return time.strftime("%Y%m%d-%H%M%S")
