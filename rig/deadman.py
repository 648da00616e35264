"""The scheduler's own time to live: a loop that hangs does not leave its last command alone."""

import threading
from collections.abc import Callable

from drivers.clock import Clock


class Deadman:
    """Calls ``stop`` once when ``feed`` has not been called for ``ttl_s``; for the wall clock.

    It runs in a thread of its own, since what it guards against is a control thread that does
    not come back. Driver and controller have their own limits behind this one.
    """

    def __init__(self, clock: Clock, ttl_s: float, stop: Callable[[], None]) -> None:
        self._clock = clock
        self._ttl_s = ttl_s
        self._stop = stop
        self._fed_s = clock.now_s()
        self._armed = False
        self._ending = threading.Event()
        self.fired = 0
        self._thread = threading.Thread(target=self._guard, name="deadman", daemon=True)
        self._thread.start()

    def feed(self) -> None:
        """A command went out just now."""
        self._fed_s = self._clock.now_s()
        self._armed = True

    def rest(self) -> None:
        """The arm was seen at rest and its last command was to stay so: nothing to guard."""
        self._armed = False

    def close(self) -> None:
        """End the thread; the arm is stopped by other hands from here on."""
        self._ending.set()
        self._thread.join()

    def _guard(self) -> None:
        while not self._ending.wait(self._ttl_s / 4.0):
            if self._armed and self._clock.now_s() - self._fed_s > self._ttl_s:
                self._armed = False
                self.fired += 1
                self._stop()
