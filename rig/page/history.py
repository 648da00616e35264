"""What the page's plots show: the last minute, at a rate that a browser draws with ease."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from rig.page.state import PageState

FloatArray = NDArray[np.float64]

_SPAN_S = 60.0
_EVERY_S = 0.1
_COLUMNS = 7


class History:
    """A row every tenth of a second of the run's time."""

    def __init__(self) -> None:
        self._rows: deque[tuple[float, ...]] = deque(maxlen=round(_SPAN_S / _EVERY_S))
        self._before: PageState | None = None  # of the last row
        self._latest_ms = 0.0  # the greatest lateness since then

    def add(self, state: PageState) -> None:
        """Take a state; time that runs backwards begins anew."""
        before = self._before
        if before is not None and state.elapsed_s < before.elapsed_s:
            self._rows.clear()
            before = self._before = None
            self._latest_ms = 0.0
        self._latest_ms = max(self._latest_ms, 1e3 * state.late_s)
        passed_s = _EVERY_S if before is None else state.elapsed_s - before.elapsed_s
        if passed_s < _EVERY_S - 1e-9:
            return
        rate_hz = np.nan if before is None else (state.ticks - before.ticks) / passed_s
        radius_mm = np.nan if state.radius_m is None else 1e3 * state.radius_m
        spread_mm = 0.0 if state.spread_m is None else 1e3 * state.spread_m
        overruns = 0 if before is None else state.overruns - before.overruns
        row = (
            state.elapsed_s,
            radius_mm,
            radius_mm - spread_mm,
            radius_mm + spread_mm,
            self._latest_ms,
            rate_hz,
            float(overruns),
        )
        self._rows.append(row)
        self._before, self._latest_ms = state, 0.0

    def radius(self) -> tuple[FloatArray, ...]:
        """t [s]; R̂ − σ, R̂ + σ, R̂ [mm], in the order they are drawn over each other; each (n,).

        From the first estimate on: a plot with gaps at its beginning finds no scale.
        """
        return self._columns([row for row in self._rows if np.isfinite(row[1])], 0, 2, 3, 1)

    def health(self) -> tuple[FloatArray, ...]:
        """t [s], greatest lateness [ms], ticks missed; each (n,)."""
        return self._columns(list(self._rows), 0, 4, 6)

    @property
    def rate_hz(self) -> float | None:
        """The loop's rate over the last row; None before there is one."""
        return self._rows[-1][5] if self._rows and np.isfinite(self._rows[-1][5]) else None

    @staticmethod
    def _columns(rows: list[tuple[float, ...]], *which: int) -> tuple[FloatArray, ...]:
        table = np.array(rows or [(0.0,) * _COLUMNS])
        return tuple(table[:, column] for column in which)
