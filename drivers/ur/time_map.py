"""From the controller's clock to the host's: a minimum-delay filter with drift."""

from collections import deque

import numpy as np

# One bucket holds the least delayed sample of a second; 30 of them see a drift of 1 ppm as 30 µs.
_BUCKET_S = 1.0
_BUCKETS = 30
_FIT_FROM = 5
# Quartz differs by tens of ppm; more than this is queueing that the fit mistook for drift.
_MAX_DRIFT = 300e-6


class TimeMap:
    """Maps controller seconds to host seconds by the least delayed arrivals seen lately.

    A sample that is true at controller time c arrives at host time c + offset + delay with
    delay ≥ 0, so the smallest (arrival − c) is the best offset. The unknown least transport
    delay stays in the offset: on a wired network that is a few tenths of a millisecond.
    """

    def __init__(self) -> None:
        self._minima: deque[tuple[float, float]] = deque(maxlen=_BUCKETS)  # (c, arrival - c)
        self._bucket: tuple[float, float] | None = None
        self._bucket_start_s = 0.0
        self._offset_s = 0.0  # at controller time _anchor_s
        self._anchor_s = 0.0
        self.drift = 0.0  # host seconds gained per controller second

    def add(self, controller_s: float, arrival_s: float) -> float:
        """Learn from one arrival; the host instant at which the sample was true.

        Never later than the arrival.
        """
        self.learn(controller_s, arrival_s)
        return self.at(controller_s)

    def at(self, controller_s: float) -> float:
        """The host instant of a controller instant, as far as arrivals have told."""
        return controller_s + self._offset_at(controller_s)

    def learn(self, controller_s: float, arrival_s: float) -> None:
        """Take one arrival; a controller clock that went back starts the filter anew."""
        delta_s = arrival_s - controller_s
        if self._bucket is None or controller_s < self._bucket_start_s:
            self._restart(controller_s, delta_s)
        elif controller_s - self._bucket_start_s >= _BUCKET_S:
            self._minima.append(self._bucket)
            self._bucket, self._bucket_start_s = (controller_s, delta_s), controller_s
            self._refit()
        elif delta_s < self._bucket[1] + self.drift * (controller_s - self._bucket[0]):
            self._bucket = (controller_s, delta_s)
        if delta_s < self._offset_at(controller_s):
            self._offset_s, self._anchor_s = delta_s, controller_s

    def _offset_at(self, controller_s: float) -> float:
        return self._offset_s + self.drift * (controller_s - self._anchor_s)

    def _restart(self, controller_s: float, delta_s: float) -> None:
        self._minima.clear()
        self._bucket, self._bucket_start_s = (controller_s, delta_s), controller_s
        self._offset_s, self._anchor_s, self.drift = delta_s, controller_s, 0.0

    def _refit(self) -> None:
        """The drift through the buckets' minima, and the line lowered onto the lowest of them."""
        at = np.array([c for c, _ in self._minima])
        delta = np.array([d for _, d in self._minima])
        if len(at) >= _FIT_FROM:
            slope = np.polyfit(at - at[-1], delta - delta[-1], 1)[0]
            self.drift = float(np.clip(slope, -_MAX_DRIFT, _MAX_DRIFT))
        self._anchor_s = float(at[-1])
        self._offset_s = float(np.min(delta - self.drift * (at - at[-1])))
