"""``rig run``: the main job."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from rig.commands.explain import explain
from rig.commands.options import (
    AsJson,
    Assignments,
    RigFile,
    Seed,
    Target,
    ViewHost,
    ViewPort,
    ViewToken,
    exit_code_of_run,
    view_for,
    warn,
)
from rig.exit_codes import ExitCode

if TYPE_CHECKING:
    from rig.calibration.result import CalibrationFile
    from rig.config import RigConfig
    from rig.records import Json
    from rig.run import RunResult


def run(
    target: Target,
    rig: RigFile = None,
    assignments: Assignments = None,
    duration: Annotated[
        float | None,
        typer.Option(
            help="Seconds from the first image used to the end; default: the rig file's "
            "run.duration_s."
        ),
    ] = None,
    until_converged: Annotated[
        bool, typer.Option("--until-converged", help="End as soon as the estimate has settled.")
    ] = False,
    until: Annotated[
        str | None,
        typer.Option(
            metavar="SHARE",
            help="End when the 95 % interval of R is within ± this, as 0.5%; default: the rig "
            "file's run.until_share, none.",
        ),
    ] = None,
    servo: Annotated[
        bool,
        typer.Option(
            "--servo",
            help="Bring the target to motion.servo's place in the image and distance, around it "
            "meanwhile (motion.policy=servo); end when there.",
        ),
    ] = False,
    realtime: Annotated[
        bool,
        typer.Option(
            "--realtime", help="Run a simulated rig on the wall clock (real devices always do)."
        ),
    ] = False,
    seed: Seed = None,
    uncalibrated: Annotated[
        bool,
        typer.Option(
            "--uncalibrated", help="Use nominal values, whatever `rig calibrate` has found."
        ),
    ] = False,
    as_json: AsJson = False,
    view: Annotated[
        bool,
        typer.Option("--view", help="Serve a live page with a STOP button (extra `view`)."),
    ] = False,
    view_port: ViewPort = None,
    view_host: ViewHost = None,
    view_token: ViewToken = None,
    report: Annotated[
        bool, typer.Option(help="Write report.html and report.png at the end.")
    ] = True,
    out: Annotated[
        Path | None,
        typer.Option(help="The run directory to make; default: a new dated one below runs/."),
    ] = None,
) -> None:
    """Move the camera, estimate the target's radius and pose, write a run directory."""
    from drivers.errors import ConfigError
    from rig.calibrated import calibrated
    from rig.config_load import load_config
    from rig.page.address import page_address
    from rig.page.watching import watching
    from rig.recorded.read import read_run
    from rig.records import make_run_dir
    from rig.report.write import write_reports
    from rig.run import execute
    from rig.stop_request import StopRequest
    from rig.summary import JSON_KEYS
    from rig.summary_table import table

    extra = list(assignments or [])
    extra += [] if duration is None else [f"run.duration_s={duration!r}"]
    extra += [] if seed is None else [f"sim.seed={seed}"]
    extra += ["run.until_converged=true"] if until_converged else []
    extra += ["motion.policy=servo"] if servo else []
    extra += [] if until is None else [f"run.until_share={_share(until)!r}"]
    geometry = calibrated(load_config(target, rig, extra), rig, uncalibrated)
    config = geometry.config
    warn(f"calibration: {geometry.source}")
    warn(f"estimator: {_estimator(config)}")
    address = page_address(view_host, view_port, view_token) if view else None
    run_dir = make_run_dir(out, target)
    console = Console(stderr=as_json)
    with watching(address, config.safety) as page:
        if page.url is not None:
            warn(f"live page: {page.url}")
        with StopRequest() as stop_requested:
            shown, stopped = page.beside(view_for(console)), page.or_else(stop_requested)
            result = execute(
                *(config, target, run_dir, realtime, shown, stopped, geometry.source),
                attachments=() if geometry.path is None else (geometry.path,),
            )
        # First of all: what was measured is not to be lost to whatever goes wrong from here on.
        _write(run_dir, result.summary)
        limits = _limits(result, config, geometry.file)
        if limits:
            result.summary.update(limits)
            _write(run_dir, result.summary)
        if as_json:
            print(json.dumps({key: result.summary[key] for key in JSON_KEYS}), flush=True)
        console.print(table(result.summary))
        if report:
            try:
                write_reports([read_run(run_dir)], run_dir)
            except (OSError, ConfigError) as error:  # what was measured stands all the same
                _not_complete(run_dir, error)
    explain(result, config)
    code = exit_code_of_run(result.outcome, result.summary)
    if code is not ExitCode.OK:
        raise typer.Exit(code)


def _estimator(config: "RigConfig") -> str:
    """Which estimator was chosen and, where that may surprise, why."""
    section = config.estimator
    if section.why_observer:
        return f"observer{section.why_observer}; estimator.kind=kalman chooses the Kalman filter"
    if section.gains_given and section.chosen not in ("observer", "limb_plane"):
        return f"{section.chosen}; estimator.alpha and estimator.damping serve rms_vs_ideal only"
    return section.chosen


def _share(text: str) -> float:
    """What ``0.5%`` or ``0.005`` means."""
    number, percent, rest = text.strip().partition("%")
    try:
        value = float(number) / (100.0 if percent else 1.0)
    except ValueError:
        value = 0.0
    if rest or not 0.0 < value < 1.0:
        raise typer.BadParameter(f"--until {text!r}: write it as 0.5% or 0.005")
    return value


def _limits(
    result: "RunResult", config: "RigConfig", calibration: "CalibrationFile | None"
) -> "dict[str, Json]":
    """What the calibration limits the radius to; empty where that is not known.

    A run's result stands without it, so neither Ctrl-C nor a failure in here ends the program.
    """
    from estimator.twist_history import MotionUnknownError
    from rig.calibration.spread import covariance_of
    from rig.calibration_limits import calibration_limits
    from rig.run import make_observer
    from rig.summary import limits_of

    std_m = result.summary["radius_std_m"]
    covariance = None if calibration is None else covariance_of(calibration)
    if covariance is None or result.summary["radius_m"] is None:
        return {}
    data, lens = result.outcome.data, result.intrinsics
    try:
        limits = calibration_limits(data, config, lens, covariance, make_observer)
        return limits_of(limits, std_m if isinstance(std_m, float) else None)
    except KeyboardInterrupt:
        warn("interrupted: what the calibration limits the radius to was not worked out")
    except (MotionUnknownError, ArithmeticError, ValueError) as error:
        warn(f"warning: what the calibration limits the radius to is not known: {error}")
    return {}


def _write(run_dir: Path, summary: "dict[str, Json]") -> None:
    from rig.records import write_summary

    try:
        write_summary(run_dir, summary)
    except OSError as error:  # what was measured stands all the same
        _not_complete(run_dir, error)


def _not_complete(run_dir: Path, error: Exception) -> None:
    warn(f"warning: {run_dir} is not complete: {error}")
