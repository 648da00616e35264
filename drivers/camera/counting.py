"""Counts exposures, so that a dropped frame shows as a gap, and measures their rate."""


class ExposureCounter:
    """Numbers a camera's frames over all its re-openings; a gap is a dropped frame.

    The source's own sequence numbers are used where it has them; otherwise a gap shows in the
    source's own stamps. From arrival times no gap is concluded within a session: a frame that
    comes late is not a frame that was lost.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._seq = -1
        self._last_sequence: int | None = None
        self._last_s: float | None = None
        self._new_session = True
        self.dropped = 0

    def use_period(self, period_s: float) -> None:
        """Replace the nominal period by the measured one."""
        self._period_s = period_s

    def reopened(self) -> None:
        """The source was opened again: its own count has started anew."""
        self._new_session = True

    def next(self, t_s: float, sequence: int | None, own_stamp: bool) -> int:
        """The number of the exposure at ``t_s``."""
        step = self._step(t_s, sequence, own_stamp)
        # What an interruption cost is told by the gap; it was not dropped by the camera.
        self.dropped += 0 if self._new_session else step - 1
        self._new_session = False
        self._seq += step
        self._last_sequence, self._last_s = sequence, t_s
        return self._seq

    def _step(self, t_s: float, sequence: int | None, own_stamp: bool) -> int:
        if self._last_s is None:
            return 1
        by_time = max(1, round((t_s - self._last_s) / self._period_s))
        if self._new_session:
            return by_time
        if sequence is not None and self._last_sequence is not None:
            return max(1, sequence - self._last_sequence)
        return by_time if own_stamp else 1


class RateMeter:
    """The mean frame rate over ``span_s``, leaving out the first ``skip`` frames."""

    def __init__(self, span_s: float, skip: int) -> None:
        self._span_s = span_s
        self._skip = skip
        self._first_s: float | None = None
        self._last_s = 0.0
        self._intervals = 0

    def add(self, t_s: float) -> None:
        """Count a frame."""
        if self._skip > 0:
            self._skip -= 1
        elif self._first_s is None:
            self._first_s = self._last_s = t_s
        else:
            self._intervals += 1
            self._last_s = t_s

    @property
    def done(self) -> bool:
        """Whether the span is covered."""
        return self._first_s is not None and self._last_s - self._first_s >= self._span_s

    @property
    def rate_hz(self) -> float | None:
        """The rate so far; None before the second frame counted."""
        if self._first_s is None or self._last_s <= self._first_s:
            return None
        return self._intervals / (self._last_s - self._first_s)
