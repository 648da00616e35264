"""``rig compare``: estimators and camera motions over many simulated runs."""

import json
import os
from pathlib import Path
from typing import Annotated, Literal, cast

import typer
from rich.console import Console
from rich.progress import Progress

from rig.commands.options import AsJson, Assignments, RigFile, Target
from rig.exit_codes import ExitCode

_WIDTH = 132


def compare(
    target: Target,
    estimators: Annotated[
        str,
        typer.Option(help="Of observer, kalman, batch, triangulation, limb_plane, limb_plane_ekf."),
    ] = "observer,kalman",
    policies: Annotated[
        str, typer.Option(help="Of constant, paper, information, circle.")
    ] = "constant,paper,information",
    noise: Annotated[str, typer.Option(help="Of clean, hard, laggy, lossy.")] = "clean,hard",
    seeds: Annotated[int, typer.Option(min=1, max=100000, help="Runs of each.")] = 20,
    duration: Annotated[float, typer.Option(min=0.2, max=60.0, help="Of a run, in s.")] = 3.0,
    level: Annotated[
        Literal["features", "pixels"],
        typer.Option(help="Measured in rendered images, or what that would find (faster)."),
    ] = "features",
    jobs: Annotated[
        int | None, typer.Option(min=1, max=256, help="Processes; default: one per processor.")
    ] = None,
    rig: RigFile = None,
    assignments: Assignments = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Where results and figure go, the same again goes on where it was stopped; "
            "default: a new one below runs/."
        ),
    ] = None,
) -> None:
    """Compare estimators and camera motions on the simulated rig: a table, a figure, parquet."""
    from rig.build import is_simulated
    from rig.campaign.campaign import run_campaign
    from rig.campaign.cases import EstimatorKind, NoiseKind, PolicyKind, cases_of, chosen
    from rig.campaign.figure import draw_campaign
    from rig.campaign.store import Store
    from rig.campaign.table import lines_of, records_of, table_of
    from rig.config_load import dump_config, load_config
    from rig.records import make_figures_dir
    from rig.stop_request import StopRequest

    try:
        cases = cases_of(
            target,
            cast(list[EstimatorKind], chosen(estimators, EstimatorKind, "--estimators")),
            cast(list[PolicyKind], chosen(policies, PolicyKind, "--policies")),
            cast(list[NoiseKind], chosen(noise, NoiseKind, "--noise")),
            seeds,
        )
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    if not cases:
        raise typer.BadParameter("--policies information needs --estimators kalman")
    extra = (f"sim.level={level}", f"run.duration_s={duration!r}", *(assignments or []))
    # Before anything starts: each combination's configuration must be one.
    base = load_config(target, rig, list(extra))
    if not is_simulated(base):
        raise typer.BadParameter("only simulated rigs can be compared: choose another --rig")
    for case in cases[::seeds]:
        load_config(target, rig, [*case.assignments, *extra])
    directory = make_figures_dir(out, f"compare-{target}")
    store = Store(directory, {"target": target, "config": dump_config(base)})
    console = Console(stderr=True)
    processes = jobs or len(os.sched_getaffinity(0))
    with StopRequest("stopping; what is finished is kept …") as stop, _bar(console) as bar:
        missing = len(store.missing(cases))
        task = bar.add_task(f"{target}", total=len(cases), completed=len(cases) - missing)
        whole = run_campaign(
            cases, store, rig, extra, processes, lambda row: bar.advance(task), stop
        )
    wanted = {(c.noise, c.policy, c.estimator, c.seed) for c in cases}
    rows = [
        row
        for row in store.rows
        if (row["noise"], row["policy"], row["estimator"], row["seed"]) in wanted
    ]
    if rows:
        lines = lines_of(rows)
        if as_json:
            print(json.dumps(records_of(lines), allow_nan=False), flush=True)
        _console(as_json).print(table_of(target, lines))
        draw_campaign(directory / "compare.png", target, rows)
    console.print(f"results: {directory}", highlight=False)
    if not whole:
        console.print("interrupted: the same command with this --out goes on", highlight=False)
        raise typer.Exit(ExitCode.INTERRUPTED)


def _bar(console: Console) -> Progress:
    return Progress(console=console, transient=True)


def _console(stderr: bool) -> Console:
    """As wide as the table where nothing says how wide it may be."""
    console = Console(stderr=stderr)
    return console if console.is_terminal else Console(stderr=stderr, width=_WIDTH)
