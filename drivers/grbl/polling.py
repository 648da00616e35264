"""When to ask for a status report, and when the silence has lasted too long."""

# A request may get no answer (1 to 4 % do not): ask again after this, never wait for it.
_ASK_AGAIN_S = 0.050
# Of 4 % lost, this many in a row are lost once in two days of polling.
_ASKED_IN_VAIN = 5
# Without reports the arm's states grow old, even where lines are still acknowledged.
_NO_REPORT_S = 0.5


class Polling:
    """Requests at a steady rate; a lost one delays the next by little."""

    def __init__(self, rate_hz: float, silence_s: float, now_s: float) -> None:
        self._period_s = 1.0 / rate_hz
        self._again_s = max(_ASK_AGAIN_S, self._period_s)
        self._silence_s = silence_s
        self._asked_s = float("-inf")
        self._waiting = False
        self._heard_s = self._answered_s = now_s
        self._in_vain = 0

    def request(self, now_s: float) -> bytes:
        """``?`` when it is time."""
        wait_s = self._again_s if self._waiting else self._period_s
        # Half a millisecond early rather than a whole look late.
        if now_s - self._asked_s < wait_s - 0.0005:
            return b""
        self._in_vain += int(self._waiting)
        late_s = now_s - self._asked_s - wait_s
        self._asked_s = now_s if late_s > self._period_s else self._asked_s + wait_s
        self._waiting = True
        return b"?"

    def answered(self, now_s: float) -> None:
        """A report arrived."""
        self._waiting = False
        self._in_vain = 0
        self._heard_s = self._answered_s = now_s

    def heard(self, now_s: float) -> None:
        """Anything sensible arrived: the controller lives."""
        self._heard_s = now_s

    def silent(self, now_s: float) -> bool:
        """Whether several requests in a row went unanswered for too long."""
        # Counting requests as well: a starved thread must not blame the controller.
        unheard = now_s - self._heard_s > self._silence_s
        unreported = now_s - self._answered_s > _NO_REPORT_S + self._silence_s
        return (unheard or unreported) and self._in_vain >= _ASKED_IN_VAIN
