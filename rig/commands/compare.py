"""``rig compare``: estimators and camera motions over many simulated runs."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer
from rich.console import Console
from rich.progress import Progress

from rig.commands.options import AsJson, Assignments, RigFile, Target
from rig.exit_codes import ExitCode

if TYPE_CHECKING:
    from rig.campaign.workers import Workers

_WIDTH = 148


def compare(
    target: Target,
    estimators: Annotated[
        str,
        typer.Option(help="Of observer, kalman, batch, triangulation, limb_plane, limb_plane_ekf."),
    ] = "observer,kalman",
    policies: Annotated[
        str, typer.Option(help="Of constant, paper, information, circle, servo.")
    ] = "constant,paper,information",
    noise: Annotated[str, typer.Option(help="Of clean, hard, laggy, lossy.")] = "clean,hard",
    starts: Annotated[
        str, typer.Option(help="Of default, axial, near, far; of a cylinder also along.")
    ] = "default",
    seeds: Annotated[int, typer.Option(min=1, max=100000, help="Runs of each.")] = 20,
    duration: Annotated[float, typer.Option(min=0.2, max=60.0, help="Of a run, in s.")] = 3.0,
    level: Annotated[
        Literal["features", "pixels"],
        typer.Option(help="Measured in rendered images, or what that would find (faster)."),
    ] = "features",
    jobs: Annotated[
        int | None, typer.Option(min=1, max=256, help="Processes; default: one per processor.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://HOST:PORT",
            help="Have a Dask cluster do the runs (extra `cluster`), not this machine.",
        ),
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
    from rig.campaign.cases import (
        EstimatorKind,
        NoiseKind,
        PolicyKind,
        StartKind,
        cases_of,
        chosen,
    )
    from rig.campaign.cluster import check_address
    from rig.campaign.figure import draw_campaign
    from rig.campaign.job import Job
    from rig.campaign.sources import sources_here
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
            cast(list[StartKind], chosen(starts, StartKind, "--starts")),
        )
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    if not cases:
        raise typer.BadParameter("--policies information needs --estimators kalman")
    if scheduler is not None and jobs is not None:
        raise typer.BadParameter("--jobs is for this machine: a cluster has the workers it has")
    if scheduler is not None:
        check_address(scheduler)
    extra = (f"sim.level={level}", f"run.duration_s={duration!r}", *(assignments or []))
    # Before anything starts: each combination's configuration must be one.
    base = load_config(target, rig, list(extra))
    if not is_simulated(base):
        raise typer.BadParameter("only simulated rigs can be compared: choose another --rig")
    for case in cases[::seeds]:
        load_config(target, rig, [*case.assignments, *extra])
    directory = make_figures_dir(out, f"compare-{target}")
    sources = sources_here()
    store = Store(directory, {"target": target, "config": dump_config(base), "program": sources})
    console = Console(stderr=True)
    plain = dump_config(load_config(target, rig))
    console.print(f"results: {directory}", highlight=False)
    with StopRequest("stopping; what is finished is kept …") as stop, _bar(console) as bar:
        missing = len(store.missing(cases))
        task = bar.add_task(f"{target}", total=len(cases), completed=len(cases) - missing)
        whole = run_campaign(
            cases,
            store,
            _workers(scheduler, jobs),
            lambda case: Job(case, plain, extra, sources),
            lambda row: bar.advance(task),
            stop,
        )
    rows = store.rows_of(cases)
    if rows:
        lines = lines_of(rows)
        if as_json:
            print(json.dumps(records_of(lines), allow_nan=False), flush=True)
        _console(as_json).print(table_of(target, lines))
        draw_campaign(directory / "compare.png", target, rows)
    if not whole:
        console.print("interrupted: the same command with this --out goes on", highlight=False)
        raise typer.Exit(ExitCode.INTERRUPTED)


def _workers(scheduler: str | None, jobs: int | None) -> "Workers":
    from rig.campaign.cluster import ClusterWorkers
    from rig.campaign.workers import LocalWorkers

    if scheduler is None:
        return LocalWorkers(jobs or len(os.sched_getaffinity(0)))
    return ClusterWorkers(scheduler)


def _bar(console: Console) -> Progress:
    return Progress(console=console, transient=True)


def _console(stderr: bool) -> Console:
    """As wide as the table where nothing says how wide it may be."""
    console = Console(stderr=stderr)
    return console if console.is_terminal else Console(stderr=stderr, width=_WIDTH)
