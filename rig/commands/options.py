"""Options that several commands share, and how a run leaves the process."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.console import Console

from rig.exit_codes import ExitCode, exit_code_of

if TYPE_CHECKING:
    from rig.live import View
    from rig.outcome import RunOutcome
    from rig.records import Json

Target = Annotated[
    Literal["sphere", "cylinder"], typer.Option(help="What to measure.", show_default=False)
]
RigFile = Annotated[
    Path | None,
    typer.Option("--rig", help="The rig's YAML file; default: the simulated rig."),
]
Assignments = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Override one key of the rig file, as estimator.alpha=5000; repeatable.",
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(help="Seed of the simulated rig; default: the rig file's sim.seed."),
]
ViewPort = Annotated[
    int | None,
    typer.Option(min=1, max=65535, help="The page's port; default: 8080, or a free one."),
]
ViewHost = Annotated[
    str | None,
    typer.Option(help="The page's address; default: 127.0.0.1. Any other needs --view-token."),
]
ViewToken = Annotated[
    str | None,
    typer.Option(
        help="What whoever opens the page has to know: letters and digits; default: nothing."
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="JSON on stdout, everything else on stderr.")]


def view_for(console: Console) -> "View":
    """A table in place on a terminal, a line a second elsewhere."""
    from drivers.clock import WallClock
    from rig.live import PlainView, TerminalView

    return TerminalView(console, WallClock().now_s) if console.is_terminal else PlainView(console)


def exit_code_of_run(outcome: "RunOutcome", summary: Mapping[str, "Json"]) -> ExitCode:
    """0 only for a run that obtained a radius and was not cut short."""
    from rig.outcome import Ending

    if outcome.error is not None:
        return exit_code_of(outcome.error)
    if outcome.ending is Ending.INTERRUPTED:
        return ExitCode.INTERRUPTED
    return ExitCode.TARGET_LOST if summary["radius_m"] is None else ExitCode.OK


def warn(text: str) -> None:
    """One line on stderr."""
    print(text, file=sys.stderr)
