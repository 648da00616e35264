"""``rig calibrate``: intrinsics, hand-eye, latency, verification; and the board to print."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.console import Console

from rig.commands.options import AsJson, Assignments, RigFile, Seed, warn
from rig.exit_codes import ExitCode

if TYPE_CHECKING:
    from rig.calibration.result import CalibrationFile
    from rig.calibration_run.session import Session
    from rig.calibration_run.store import Store
    from rig.config import RigConfig

calibrate_app = typer.Typer(
    help="Find the camera's intrinsics, its place on the tool and the latency of its images; "
    "without a step: all of them, in order, and a verdict.",
    invoke_without_command=True,
)

Step = Literal["all", "intrinsics", "hand-eye", "latency", "verify"]
_STEPS: dict[Step, str] = {
    "intrinsics": "Look at the board from many poses; intrinsics and hand-eye are fitted together.",
    "hand-eye": "Look at the board from many poses; intrinsics and hand-eye are fitted together.",
    "latency": "Wiggle in front of the board, on what the hand-eye step collected.",
    "verify": "Check the calibration with small motions and fresh poses.",
}
_ON_EARLIER_DATA = ("latency", "verify")
Realtime = Annotated[
    bool, typer.Option("--realtime", help="Run a simulated rig on the wall clock.")
]
Resume = Annotated[
    bool, typer.Option("--resume", help="Go on with what an interrupted calibration collected.")
]


@dataclass(frozen=True, slots=True)
class Request:
    """What the command line asks for."""

    rig: Path | None
    assignments: tuple[str, ...]
    seed: int | None
    resume: bool
    realtime: bool
    as_json: bool

    def with_more(self, more: "Request") -> "Request":
        """Options may stand before the step and after it; what stands after goes before."""
        return Request(
            more.rig or self.rig,
            (*self.assignments, *more.assignments),
            self.seed if more.seed is None else more.seed,
            self.resume or more.resume,
            self.realtime or more.realtime,
            self.as_json or more.as_json,
        )


@calibrate_app.callback()
def calibrate(
    context: typer.Context,
    rig: RigFile = None,
    assignments: Assignments = None,
    seed: Seed = None,
    resume: Resume = False,
    realtime: Realtime = False,
    as_json: AsJson = False,
) -> None:
    """Calibrate everything, in order: intrinsics, hand-eye, latency, verification."""
    context.obj = Request(rig, tuple(assignments or ()), seed, resume, realtime, as_json)
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
    ) -> None:
        own = Request(rig, tuple(assignments or ()), seed, resume, realtime, as_json)
        _run(step, context.obj.with_more(own))

    return command


for _step, _help in _STEPS.items():
    calibrate_app.command(_step, help=_help)(_command(_step))


@calibrate_app.command()
def board(
    squares: Annotated[str, typer.Option(help="Squares in a row x in a column.")] = "7x5",
    square: Annotated[float, typer.Option(help="Side of a square, m.")] = 0.03,
    marker: Annotated[float, typer.Option(help="Side of a marker, m.")] = 0.022,
    dictionary: Annotated[str, typer.Option(help="OpenCV's name of the markers.")] = "DICT_4X4_50",
    paper: Annotated[
        Literal["a4", "a3", "letter"], typer.Option(help="The paper to print on.")
    ] = "a4",
    out: Annotated[Path, typer.Option(help="The PDF to write.")] = Path("board.pdf"),
) -> None:
    """Write the board as a PDF to print at 100 %, and its definition for the rig file."""
    from pydantic import ValidationError

    from drivers.errors import ConfigError
    from rig.calibration.board import BoardConfig
    from rig.calibration.board_pdf import board_pdf, definition

    columns, _, rows = squares.partition("x")
    if not (columns.isdigit() and rows.isdigit()):
        raise ConfigError(f"--squares {squares}: two numbers like 7x5 are needed")
    try:
        config = BoardConfig(
            squares=(int(columns), int(rows)),
            square_m=square,
            marker_m=marker,
            dictionary=dictionary,
        )
    except ValidationError as error:
        raise ConfigError(f"this board cannot be: {error.errors()[0]['msg']}") from error
    try:
        out.write_bytes(board_pdf(config, paper))
    except OSError as error:
        raise ConfigError(f"cannot write {out}: {error}") from error
    warn(f"{out}: print it at 100 %, measure the ruler, then put this into the rig file:")
    print(definition(config), end="")


def _run(step: Step, request: Request) -> None:
    from drivers.clock import WallClock
    from rig.build import is_simulated
    from rig.calibrated import calibration_path, fingerprints, with_nominal
    from rig.calibration.result import CalibrationFile, load_calibration
    from rig.calibration_run.bench import open_bench
    from rig.calibration_run.progress import ConsoleProgress
    from rig.calibration_run.recorded import RecordedProgress, open_calibration_log, recorded
    from rig.calibration_run.session import Session
    from rig.calibration_run.store import Store
    from rig.calibration_run.summary import json_of, table
    from rig.config_load import load_config
    from rig.stop_request import StopRequest

    extra = [*request.assignments]
    extra += [] if request.seed is None else [f"sim.seed={request.seed}"]
    config = with_nominal(load_config("sphere", request.rig, extra))
    path, depends_on = calibration_path(config), fingerprints(config)
    console = Console(stderr=True)
    resume = request.resume or step in _ON_EARLIER_DATA
    store = Store(path.with_name(f"{config.name}-data"), depends_on, resume)
    before: CalibrationFile | None = None
    if step != "all" and path.exists():
        before = load_calibration(path)
    wall = WallClock()
    start_s = wall.now_s()
    log_path = path.with_name(f"{config.name}-data") / f"log-{step}.mcap"
    realtime = request.realtime or not is_simulated(config)
    with (
        StopRequest() as stop_requested,
        open_bench(config, request.realtime) as bench,
        open_calibration_log(log_path, config, bench, realtime) as log,
    ):
        session = Session(
            config,
            recorded(bench, log),
            store,
            path,
            before,
            depends_on,
            RecordedProgress(ConsoleProgress(console), log, bench),
            stop_requested,
        )
        found = _steps(session, step)
        log.attach(path)
    report = _report(session, store, found, path)
    summary = {**json_of(session, found, path, wall.now_s() - start_s), "report": report}
    if request.as_json:
        print(json.dumps(summary), flush=True)
    console.print(table(summary))
    _finish(found, config, path)


def _report(session: "Session", store: "Store", found: "CalibrationFile", path: Path) -> str | None:
    """Write the report beside the calibration; where it is, None when that fails."""
    from rig.calibration_report.material import Material
    from rig.calibration_report.page import write_report

    material = Material(
        found,
        store.stills,
        session.geometry,
        store.recording,
        session.latency,
        session.verification,
    )
    try:
        page = write_report(path.with_name(f"{found.rig}-report"), material)
    except OSError as error:  # the result stands all the same
        warn(f"no report: {error}")
        return None
    warn(f"report: {page}")
    return str(page)


def _steps(session: "Session", step: Step) -> "CalibrationFile":
    """The step asked for, on what those before it left; then the verdict."""
    if step in ("all", "intrinsics", "hand-eye"):
        session.collect()
        session.fit()
    if step in ("all", "latency"):
        session.measure_latency()
    if step in ("all", "verify"):
        session.check()
    return session.conclude()


def _finish(found: "CalibrationFile", config: "RigConfig", path: Path) -> None:
    verdict = found.verdict
    if verdict is not None and not verdict.passed:
        for reason in verdict.reasons:
            warn(f"not usable yet: {reason}")
        raise typer.Exit(ExitCode.CALIBRATION)
    warn(f"{path}: `rig run` uses it from here on")
