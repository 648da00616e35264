"""A calibration's progress as lines on a console."""

import numpy as np
from rich.console import Console

from rig.calibration_run.collector import PoseReport


class ConsoleProgress:
    """One line a step and one a pose."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def step(self, name: str, detail: str) -> None:
        """A step begins."""
        self._console.print(f"[bold]{name}[/bold]: {detail}", highlight=False)

    def pose(self, report: PoseReport) -> None:
        """A pose was looked from, with what it was expected to add, or skipped."""
        pose = report.pose
        where = (
            f"{report.number:3d}/{report.wanted}  {100 * pose.distance_m:.0f} cm, tilted "
            f"{np.degrees(pose.tilt_rad):.0f}°, {pose.corners} corners expected, "
            f"adds {pose.gain:.1f} bit"
        )
        text = f"  {where}" if not report.problem else f"  {where}  skipped: {report.problem}"
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)
