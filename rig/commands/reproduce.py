"""``rig reproduce``: the paper's experiments on rendered pixels."""

import json
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console
from rich.table import Table

from rig.commands.options import AsJson, Assignments, Seed, exit_code_of_run
from rig.exit_codes import ExitCode


def reproduce(
    figure: Annotated[
        Literal["fig3", "fig4", "fig5", "all"], typer.Argument(help="Which figure of the paper.")
    ],
    assignments: Assignments = None,
    seed: Seed = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Where figures and run directories go; default: a new one in runs/."),
    ] = None,
) -> None:
    """Repeat the paper's experiments, draw each figure, and compare every curve with (5)."""
    from rig.live import QuietView
    from rig.records import make_figures_dir
    from rig.reproduce import FIGURES, describe, draw_figure, load_experiment, run_curve
    from rig.stop_request import StopRequest

    figures = FIGURES if figure == "all" else (figure,)
    extra = list(assignments or []) + ([] if seed is None else [f"sim.seed={seed}"])
    out = make_figures_dir(out, figure)
    console = Console(stderr=as_json)
    table = Table("figure", "curve", "rms from (5) [% of z(0)]", "R [mm]", "error [%]", "σ₁² end")
    with StopRequest() as stop_requested:
        for name in figures:
            experiment = load_experiment(name)
            results = []
            for curve in experiment.curves:
                console.print(f"{name}, {curve.name} …", highlight=False)
                result = run_curve(name, curve, extra, out, QuietView(), stop_requested)
                code = exit_code_of_run(result.outcome, result.summary)
                if code is not ExitCode.OK:
                    console.print(f"{name}, {curve.name}: {result.outcome.ending.value}")
                    raise typer.Exit(code)
                results.append(result)
                line = describe(name, curve, result)
                if as_json:
                    print(json.dumps(line), flush=True)
                sigma2, speed2 = result.analysis.sigma2[-50:], result.analysis.speed2[-50:]
                table.add_row(
                    name,
                    curve.name,
                    f"{100 * (result.analysis.rms_vs_ideal or 0.0):.3f}",
                    f"{1e3 * (result.analysis.radius_m[-1]):.3f}",
                    f"{100 * (result.analysis.relative_error or 0.0):+.3f}",
                    f"{sigma2.mean():.2e} of {speed2.mean():.2e} m²/s²",
                )
            draw_figure(out / f"{name}.png", experiment, results)
    console.print(table)
    console.print(f"figures and runs: {out}", highlight=False)
