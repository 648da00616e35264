"""What a person who moves the arm by hand sees: in place on a terminal."""

from types import TracebackType
from typing import Self

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from rig.calibration_run import hand_jog
from rig.calibration_run.by_hand import Glance


class HandView:
    """The newest glance, and a line for every key that did something."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live = Live(console=console, auto_refresh=False, transient=True)
        self._keys = 0

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._live.stop()

    def show(self, glance: Glance) -> None:
        """Take the newest."""
        if glance.keys != self._keys:
            self._console.print(glance.said, highlight=False, markup=False)
        self._keys = glance.keys
        self._live.update(_rendered(glance), refresh=True)


def _rendered(glance: Glance) -> Group:
    guidance = glance.guidance
    if glance.problem:
        seen = Text(f"board: {glance.problem}", style="red")
    else:
        seen = Text(f"board: {glance.corners} corners, {glance.place}", style="green")
    lines = [seen]
    lines.append(Text(f"poses: {glance.poses} of {glance.wanted} ({glance.needed} at the least)"))
    if guidance.coverage is not None:
        lines.append(Text(f"image covered: {guidance.coverage.share:.0%}"))
        rows = guidance.coverage.cells
        lines += [Text("  " + "".join("██" if n else "··" for n in row)) for row in rows]
    if guidance.done:
        lines.append(Text("there: " + ", ".join(guidance.done)))
    todo = guidance.missing[0] if guidance.missing else "nothing is missing: q ends"
    lines.append(Text(f"next: {todo}", style="bold"))
    lines.append(Text("keys: space or c takes a picture, u takes one back, q ends", style="dim"))
    if glance.jogs:
        lines.append(Text(f"      {hand_jog.HELP}", style="dim"))
    return Group(*lines)
