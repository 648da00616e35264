"""When a free-running camera exposes its frames, and when each can be read, if ever."""

import math
from functools import lru_cache

import numpy as np

from sim_backend.config import CameraConfig

# Jitter is cut off here, so that it never reorders frames further apart.
_JITTER_LIMIT_SIGMAS = 3.0
_FRAMES_REMEMBERED = 256


class FrameGrid:
    """Frame n is exposed on a fixed grid that begins at ``start_s``.

    It becomes readable ``latency_s`` plus jitter after its mid-exposure, but not before it is
    exposed and read out. With a rolling shutter a frame's instant is that of the middle row.
    """

    def __init__(self, config: CameraConfig, start_s: float, seed: int) -> None:
        self._config = config
        self._seed = seed
        self._period_s = 1.0 / config.rate_hz
        # From the first light on any row, or to the last, to the frame's instant.
        self._half_s = (config.exposure_s + config.row_time_s * (config.height - 1)) / 2
        self._first_s = start_s + self._half_s
        # Asked for every frame at every look; the answer costs two random numbers.
        self.readable_s = lru_cache(maxsize=_FRAMES_REMEMBERED)(self._drawn_readable_s)

    def mid_s(self, seq: int) -> float:
        """The middle of frame ``seq``'s exposure."""
        return self._first_s + seq * self._period_s

    def newest_exposed(self, now_s: float) -> int:
        """The highest frame number whose last light has fallen by now."""
        return math.floor((now_s - self._half_s - self._first_s) / self._period_s + 1e-9)

    def newest_readable(self, now_s: float, after: int) -> int | None:
        """The highest frame number above ``after`` that is readable now."""
        for seq in range(self.newest_exposed(now_s), after, -1):
            if self.readable_s(seq) <= now_s + 1e-9:
                return seq
        return None

    def next_readable_s(self, after: int) -> float:
        """When the next frame above ``after`` becomes readable."""
        c = self._config
        soonest_s = math.inf
        seq = after + 1
        least_s = max(c.latency_s - _JITTER_LIMIT_SIGMAS * c.latency_jitter_s, self._half_s)
        # Later frames can overtake only while even their shortest delay could be sooner.
        while self.mid_s(seq) + least_s < soonest_s:
            soonest_s = min(soonest_s, self.readable_s(seq))
            seq += 1
        return soonest_s

    def _drawn_readable_s(self, seq: int) -> float:
        """When frame ``seq`` can be read; never (infinity) if it is dropped."""
        c = self._config
        if c.latency_jitter_s == 0.0 and c.drop_probability == 0.0:
            return self.mid_s(seq) + max(c.latency_s, self._half_s)
        random = np.random.default_rng([self._seed, 3, seq])
        if random.random() < c.drop_probability:
            return math.inf
        limit = _JITTER_LIMIT_SIGMAS
        jitter_s = c.latency_jitter_s * min(max(random.standard_normal(), -limit), limit)
        return self.mid_s(seq) + max(c.latency_s + jitter_s, self._half_s)
