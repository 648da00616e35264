"""The control grid: absolute deadlines, missed ticks skipped and counted, never bunched."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import floor

import numpy as np

from drivers.clock import Clock


@dataclass(slots=True)
class TickStats:
    """How well the grid was kept."""

    ticks: int = 0
    overruns: int = 0  # grid points skipped because the tick before took too long
    late_s: list[float] = field(default_factory=list)  # start of each tick after its grid point
    scheduling: str = "simulated time"  # or how the system schedules: "normal", "realtime"

    def late_p99_s(self) -> float:
        """The 99th percentile of the lateness, 0 before the first tick."""
        return float(np.percentile(self.late_s, 99)) if self.late_s else 0.0

    def late_median_s(self) -> float:
        """The median of the lateness, 0 before the first tick."""
        return float(np.median(self.late_s)) if self.late_s else 0.0

    def late_max_s(self) -> float:
        """The greatest lateness, 0 before the first tick."""
        return max(self.late_s, default=0.0)

    def rate_hz(self, over_s: float) -> float:
        """Mean tick rate over a time span."""
        return self.ticks / over_s if over_s > 0 else 0.0


def tick_grid(clock: Clock, period_s: float, stats: TickStats) -> Iterator[float]:
    """Yield the clock's reading at each point t0 + k·period, for ever.

    Lateness never accumulates: each deadline is computed from the start, and points that have
    already passed when a tick ends are skipped and counted as overruns.
    """
    start_s = clock.now_s()
    k = 0
    while True:
        clock.sleep_until(start_s + k * period_s)
        now_s = clock.now_s()
        stats.ticks += 1
        stats.late_s.append(now_s - (start_s + k * period_s))
        yield now_s
        # A tick may end a rounding error after the next grid point without being late.
        passed = floor((clock.now_s() - start_s) / period_s + 1e-9)
        following = max(k + 1, passed)
        stats.overruns += following - (k + 1)
        k = following
