"""When to open a lost device again, and when to give it up."""


class Backoff:
    """Doubles the wait between attempts; an outage lasts until ``over`` is called."""

    def __init__(self, first_s: float, longest_s: float, give_up_after_s: float | None) -> None:
        self._first_s = first_s
        self._longest_s = longest_s
        self._give_up_after_s = give_up_after_s
        self._wait_s = first_s
        self._lost_s: float | None = None
        self.retry_at_s = 0.0

    def failed(self, now_s: float) -> float | None:
        """Plan the next attempt; returns the outage's length when it is time to give up."""
        self._lost_s = now_s if self._lost_s is None else self._lost_s
        outage_s = now_s - self._lost_s
        if self._give_up_after_s is not None and outage_s >= self._give_up_after_s:
            return outage_s
        self.retry_at_s = now_s + self._wait_s
        self._wait_s = min(2 * self._wait_s, self._longest_s)
        return None

    def over(self) -> None:
        """The device delivers again."""
        self._lost_s = None
        self._wait_s = self._first_s
