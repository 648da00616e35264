"""``rig report`` and ``rig runs``: look at past runs."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from rig.commands.options import AsJson, warn

RunDirs = Annotated[list[Path], typer.Argument(help="Run directories.", show_default=False)]


def report(
    runs: RunDirs,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Where to write; default: the run's directory, for several runs a new dated "
            "one below runs/."
        ),
    ] = None,
) -> None:
    """Write report.html (one page, no network needed) and report.png; several runs are overlaid."""
    from drivers.errors import ConfigError
    from rig.recorded.read import read_run
    from rig.records import make_figures_dir
    from rig.report.write import write_reports

    records = [read_run(run_dir) for run_dir in runs]
    alone = out is None and len(runs) == 1
    folder = runs[0] if alone else make_figures_dir(out, "report")
    try:
        paths = write_reports(records, folder)
    except OSError as error:
        raise ConfigError(f"cannot write the report into {folder}: {error}") from error
    for record in records:
        if record.summary is None:
            warn(f"{record.directory}: the run was cut off; shown as far as it was recorded")
    for path in paths:
        print(path)


def runs(
    folder: Annotated[
        Path, typer.Argument(help="Where run directories lie; default: runs.", show_default=False)
    ] = Path("runs"),
    as_json: AsJson = False,
) -> None:
    """List past runs, newest first."""
    from rig.past_runs import past_runs, table

    found = past_runs(folder)
    if as_json:
        print(json.dumps([run.as_json() for run in found]))
    elif not found:
        warn(f"no runs below {folder}")
    else:
        Console().print(table(found))
