"""Simulated time: it moves only when somebody waits for it."""

import threading


class SimulatedClock:
    """A ``drivers.clock.Clock`` whose present is the latest instant anybody slept until."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now_s = float(start_s)
        self._lock = threading.Lock()

    def now_s(self) -> float:
        """The present instant of the simulation."""
        return self._now_s

    def sleep_until(self, t_s: float) -> None:
        """Make ``t_s`` the present; does nothing when it has passed.

        Raises ValueError for an instant that is not finite: time would never come back.
        """
        if not -1e300 < t_s < 1e300:
            raise ValueError(f"cannot sleep until {t_s!r}")
        with self._lock:
            self._now_s = max(self._now_s, float(t_s))
