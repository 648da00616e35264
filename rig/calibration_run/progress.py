"""A calibration's progress: bars on a terminal, lines anywhere else."""

from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
)

from rig.calibration_run.watching import PoseReport

_REFRESH_HZ = 5.0


class ConsoleProgress:
    """One bar a step, one line a pose; use it in a ``with`` block."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bars = Progress(
            SpinnerColumn(finished_text="✓"),
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            console=console,
            refresh_per_second=_REFRESH_HZ,
            disable=not console.is_terminal,
        )
        self._task: TaskID | None = None

    def __enter__(self) -> Self:
        self._bars.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is None:
            self._finish()
        self._bars.stop()

    def step(self, name: str, detail: str, total: float | None = None) -> None:
        """A step begins, so the one before it is done."""
        self._finish()
        if not self._console.is_terminal:
            self._say(f"{name}: {detail}")
        self._task = self._bars.add_task(f"{name}: {detail}", total=total)

    def done(self, count: float) -> None:
        """Move the bar."""
        if self._task is not None:
            self._bars.update(self._task, completed=count)

    def pose(self, report: PoseReport) -> None:
        """Say from where the board was looked at and what that adds, or why it was skipped."""
        pose = report.pose
        where = (
            f"{report.number:3d}/{report.wanted}  {100 * pose.distance_m:.0f} cm, tilted "
            f"{np.degrees(pose.tilt_rad):.0f}°, {pose.corners} corners expected, "
            f"adds {pose.gain:.1f} bit"
        )
        self._say(f"  {where}" if not report.problem else f"  {where}  skipped: {report.problem}")
        self.done(report.number)

    def note(self, text: str) -> None:
        """One line above the bars."""
        self._say(text)

    def _say(self, text: str) -> None:
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def _finish(self) -> None:
        if self._task is None:
            return
        task = next(one for one in self._bars.tasks if one.id == self._task)
        total = task.total if task.total is not None else 1.0
        self._bars.update(self._task, total=total, completed=total)
        self._task = None
