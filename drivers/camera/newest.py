"""The newest frame, handed from the thread that grabs to whoever reads."""

import threading

from drivers.clock import Clock
from drivers.interfaces import Frame

# For "taken after T": an exact stamp is good to about this, any other to a period.
_STAMP_MARGIN_S = 0.002


class NewestFrame:
    """Keeps one frame; each is returned once, none is returned when it has grown too old."""

    def __init__(
        self, clock: Clock, max_age_s: float, exact: tuple[str, ...] = ("kernel", "stream")
    ) -> None:
        """``exact`` names the stamp sources whose offset to mid-exposure is known."""
        self._exact = exact
        self._clock = clock
        self._max_age_s = max_age_s
        self._changed = threading.Condition()
        self._frame: Frame | None = None
        self._puts = 0
        self._ended = False

    @property
    def puts(self) -> int:
        """How many frames were put so far."""
        return self._puts

    def put(self, frame: Frame) -> None:
        """Replace the frame kept."""
        with self._changed:
            self._frame = frame
            self._puts += 1
            self._changed.notify_all()

    def end(self) -> None:
        """No frame will follow: nobody waits from now on."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def take(self, after_s: float = -float("inf"), period_s: float = 0.0) -> Frame | None:
        """The frame kept if it is new, young, and its exposure began after ``after_s``."""
        with self._changed:
            frame = self._frame
            if frame is None:
                return None
            now_s = self._clock.now_s()
            if now_s - frame.t_exposure_mid_s > self._max_age_s:
                self._frame = None
                return None
            margin_s = _STAMP_MARGIN_S + (0.0 if frame.stamp_source in self._exact else period_s)
            if frame.t_exposure_mid_s - frame.exposure_s / 2 <= after_s + margin_s:
                return None
            self._frame = None
            return frame

    def wait(self, puts: int, seconds: float) -> None:
        """Return when more than ``puts`` frames were put, or after ``seconds`` of real time."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._puts > puts, seconds)
