"""What a person sees while it runs: a table that updates in place, or a plain line a second."""

from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import Protocol, Self

from rich.console import Console
from rich.live import Live
from rich.table import Table

from rig.outcome import LiveStatus
from rig.recorded.setup import RunSetup

_REFRESH_S = 0.1
_LINE_EVERY_S = 1.0


class View(Protocol):
    """Shows the run's state; called every tick, so it must be cheap."""

    def begin(self, setup: RunSetup) -> None:
        """Take what does not change while the run lasts; before the first state."""
        ...

    def show(self, status: LiveStatus) -> None:
        """Take the newest state."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...


class Rates:
    """Frame and tick rates over the time since the last reading."""

    def __init__(self) -> None:
        self._at = (0.0, 0, 0)
        self.camera_fps = float("nan")
        self.loop_hz = float("nan")

    def update(self, status: LiveStatus) -> None:
        """Take a reading."""
        t_s, frames, ticks = self._at
        span_s = status.elapsed_s - t_s
        if span_s > 0:
            self.camera_fps = (status.frames - frames) / span_s
            self.loop_hz = (status.ticks - ticks) / span_s
        self._at = (status.elapsed_s, status.frames, status.ticks)


class QuietView:
    """Shows nothing: for a run that is one of many."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        return None

    def begin(self, setup: RunSetup) -> None:
        """Take it and drop it."""

    def show(self, status: LiveStatus) -> None:
        """Take the state and drop it."""


class Views:
    """Several views as one."""

    def __init__(self, *views: View) -> None:
        self._views = views
        self._entered = ExitStack()

    def __enter__(self) -> Self:
        for view in self._views:
            self._entered.enter_context(view)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._entered.close()

    def begin(self, setup: RunSetup) -> None:
        """Hand it to every one."""
        for view in self._views:
            view.begin(setup)

    def show(self, status: LiveStatus) -> None:
        """Hand it to every one."""
        for view in self._views:
            view.show(status)


class PlainView:
    """One line a second of the run's own time, for pipes and logs."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._rates = Rates()
        self._next_s = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        return None

    def begin(self, setup: RunSetup) -> None:
        """Nothing of it is shown."""

    def show(self, status: LiveStatus) -> None:
        """Print when the next second has begun."""
        if status.elapsed_s < self._next_s:
            return
        self._next_s += _LINE_EVERY_S
        self._rates.update(status)
        cells = [f"{name} {value}" for name, value in rows(status, self._rates)]
        line = f"t {status.elapsed_s:5.2f} s  " + "  ".join(cells)
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)


class TerminalView:
    """A table on the terminal that updates in place ten times a second."""

    def __init__(self, console: Console, now_s: Callable[[], float]) -> None:
        self._live = Live(console=console, auto_refresh=False, transient=True)
        self._now_s = now_s
        self._rates = Rates()
        self._next_s = float("-inf")

    def __enter__(self) -> Self:
        self._live.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._live.__exit__(kind, error, traceback)

    def begin(self, setup: RunSetup) -> None:
        """Nothing of it is shown."""

    def show(self, status: LiveStatus) -> None:
        """Redraw when a tenth of a second of wall time has passed."""
        if self._now_s() < self._next_s:
            return
        self._next_s = self._now_s() + _REFRESH_S
        self._rates.update(status)
        table = Table(title=f"t = {status.elapsed_s:.2f} s", show_header=False, min_width=56)
        for name, value in rows(status, self._rates):
            table.add_row(name, value)
        self._live.update(table, refresh=True)


def rows(status: LiveStatus, rates: Rates) -> list[tuple[str, str]]:
    """The names and values that both views show."""
    estimate = status.estimate
    if estimate is None or estimate.radius_m is None:
        radius, residual = "–", "–"
    else:
        radius = f"{estimate.radius_m * 1e3:.3f} mm"
        residual = f"{estimate.residual:.1e}"
    share = 100.0 * status.remaining_fraction
    stated = estimate is not None and estimate.variance is not None
    servo = [("servo", status.servo)] if status.servo else []
    return [
        ("R", radius),
        ("residual", residual),
        ("95 % interval", f"± {share:.2g} %") if stated else ("transient left", f"{share:.1f} %"),
        ("camera", f"{rates.camera_fps:.1f} fps ({status.frames_lost} lost)"),
        ("loop", f"{rates.loop_hz:.1f} Hz ({status.overruns} overruns)"),
        *servo,
        ("speed", f"{status.speed_m_s * 1e3:.1f} mm/s"),
        ("state", status.state),
        ("limited by", ", ".join(status.limited_by) or "nothing"),
        ("target", status.target_state),
    ]
