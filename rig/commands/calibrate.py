"""``rig calibrate``: intrinsics, hand-eye, latency, verification; and the board to print."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer
from rich.console import Console

from rig.commands.calibrate_board import board
from rig.commands.calibrate_report import write_report_of
from rig.commands.calibrate_request import (
    ON_EARLIER_DATA,
    DryRun,
    FromImages,
    Manual,
    Realtime,
    Request,
    Resume,
    RollingShutter,
    Step,
    earlier,
    instead_of,
    with_earlier,
)
from rig.commands.options import AsJson, Assignments, RigFile, Seed, warn
from rig.exit_codes import CALIBRATING, PLAIN, ExitCode

if TYPE_CHECKING:
    from pathlib import Path

    from rig.calibration.result import CalibrationFile
    from rig.calibration_run.session import Session
    from rig.calibration_run.store import Store

calibrate_app = typer.Typer(
    help="Find the camera's intrinsics, its place on the tool and the latency of its images; "
    "without a step: all of them, in order, and a verdict.",
    invoke_without_command=True,
    epilog=CALIBRATING,
)

_STEPS: dict[Step, str] = {
    "intrinsics": "Look at the board from many poses; intrinsics and hand-eye are fitted together.",
    "hand-eye": "Look at the board from many poses; intrinsics and hand-eye are fitted together.",
    "latency": "Wiggle in front of the board, on what the hand-eye step collected.",
    "verify": "Check the calibration with small motions and fresh poses.",
}


@calibrate_app.callback()
def calibrate(
    context: typer.Context,
    rig: RigFile = None,
    assignments: Assignments = None,
    seed: Seed = None,
    resume: Resume = False,
    realtime: Realtime = False,
    as_json: AsJson = False,
    from_images: FromImages = None,
    manual: Manual = False,
    dry_run: DryRun = False,
    rolling_shutter: RollingShutter = False,
) -> None:
    """Calibrate everything, in order: intrinsics, hand-eye, latency, verification."""
    modes = from_images, manual, dry_run, rolling_shutter
    context.obj = Request(rig, tuple(assignments or ()), seed, resume, realtime, as_json, *modes)
    if context.invoked_subcommand is None:
        _run("all", context.obj)


def _command(step: Step) -> Callable[..., None]:
    """The command of one step; all take the same options."""

    def command(
        context: typer.Context,
        rig: RigFile = None,
        assignments: Assignments = None,
        seed: Seed = None,
        resume: Resume = False,
        realtime: Realtime = False,
        as_json: AsJson = False,
        from_images: FromImages = None,
        manual: Manual = False,
        dry_run: DryRun = False,
        rolling_shutter: RollingShutter = False,
    ) -> None:
        modes = from_images, manual, dry_run, rolling_shutter
        own = Request(rig, tuple(assignments or ()), seed, resume, realtime, as_json, *modes)
        _run(step, context.obj.with_more(own))

    return command


for _step, _help in _STEPS.items():
    calibrate_app.command(_step, help=_help, epilog=CALIBRATING)(_command(_step))


calibrate_app.command(epilog=PLAIN)(board)


def _run(step: Step, request: Request) -> None:
    request.check(step)
    if request.from_images is not None:
        from rig.commands.calibrate_images import calibrate_from_images

        calibrate_from_images(request.from_images, request)
    elif request.dry_run:
        from rig.commands.calibrate_dry_run import dry_run

        dry_run(step, request)
    else:
        _on_the_rig(step, request)


def _on_the_rig(step: Step, request: Request) -> None:
    from drivers.clock import WallClock
    from rig.build import is_simulated
    from rig.calibration_place import calibration_path
    from rig.calibration_run.bench import open_bench
    from rig.calibration_run.hand_view import HandView
    from rig.calibration_run.keys import Keys
    from rig.calibration_run.progress import ConsoleProgress
    from rig.calibration_run.recorded import RecordedProgress, open_calibration_log, recorded
    from rig.calibration_run.session import Session
    from rig.calibration_run.store import Store
    from rig.calibration_run.summary import json_of, table
    from rig.fingerprints import fingerprints
    from rig.start_values import with_nominal
    from rig.stop_request import StopRequest

    config = request.config()
    path, depends_on = calibration_path(config, request.rig), fingerprints(config)
    before = earlier(step, path, depends_on)
    config = with_nominal(with_earlier(config, step, before))
    console = Console(stderr=True)
    resume = request.resume or step in ON_EARLIER_DATA
    store = Store(path.with_name(f"{config.name}-data"), depends_on, resume, instead_of(step))
    wall = WallClock()
    start_s = wall.now_s()
    log_path = path.with_name(f"{config.name}-data") / f"log-{step}.mcap"
    realtime = request.realtime or not is_simulated(config)
    by_hand = request.manual
    # Before anything is opened: without a terminal there are no keys.
    keys = Keys() if by_hand else None
    with (
        _keeping(store),
        StopRequest("stopping …" if by_hand else "stopping the arm …") as stop,
        open_bench(config, request.realtime, by_hand) as bench,
        open_calibration_log(log_path, config, bench, realtime) as log,
    ):
        depends_on |= bench.conditions()
        store.also_under(depends_on)
        if bench.assumed:
            warn(bench.assumed)
        shown = ConsoleProgress(console)
        progress = RecordedProgress(shown, log, bench)
        watched = recorded(bench, log)
        session = Session(config, watched, store, path, before, depends_on, progress, stop)
        if keys is not None:
            with keys, HandView(console) as view:
                session.collect_by_hand(keys, view.show)
        with shown:
            found = _steps(session, step, by_hand)
        log.attach(path)
    report = write_report_of(session, store, found, path)
    summary = json_of(session.delay_s, found, path, wall.now_s() - start_s) | {"report": report}
    if request.as_json:
        print(json.dumps(summary), flush=True)
    console.print(table(summary))
    _finish(found, "hand-eye" if by_hand else step, path)


@contextmanager
def _keeping(store: "Store") -> Iterator[None]:
    """Say what an interrupted calibration leaves behind; what failed for good is not resumed."""
    from rig.calibration.errors import CalibrationError, UnusableCalibrationError

    try:
        yield
    except (CalibrationError, UnusableCalibrationError):
        raise
    except BaseException:
        if store.stills:
            recorded = "" if store.recording is None else " and the wiggles"
            warn(
                f"kept: {len(store.stills)} poses{recorded} in {store.directory}; the same "
                "command with --resume goes on from there"
            )
        raise


def _steps(session: "Session", step: Step, by_hand: bool) -> "CalibrationFile":
    """The step asked for, on what those before it left; then the verdict."""
    if by_hand:
        session.fit()
        return session.conclude()  # the other steps move the arm by themselves
    if step in ("all", "intrinsics", "hand-eye"):
        session.collect()
        session.fit()
    if step in ("all", "latency"):
        session.measure_latency()
    if step in ("all", "verify"):
        session.check()
    return session.conclude()


def _finish(found: "CalibrationFile", step: Step, path: "Path") -> None:
    """Say whether the result may be used; a step alone did its part whatever else is missing."""
    verdict = found.verdict
    if verdict is None or verdict.passed:
        warn(f"{path}: `rig run` uses it from here on")
        return
    for reason in verdict.reasons:
        warn(f"not usable yet: {reason}")
    if step == "all" or not all(" is missing: " in reason for reason in verdict.reasons):
        raise typer.Exit(ExitCode.CALIBRATION)
