"""``rig doctor``: what this machine and a rig's devices can do, measured; nothing moves."""

import json
import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from drivers.errors import ConfigError
from rig.commands.options import AsJson, Assignments, RigFile, warn
from rig.exit_codes import ExitCode

if TYPE_CHECKING:
    from rig.doctor.finding import Finding
    from rig.doctor.subject import Subject

EXIT_CODES = (
    "Exit codes: 0 nothing failed (warnings are allowed), 2 wrong usage or configuration, "
    "3 a check failed, 130 interrupted."
)


def doctor(
    file: Annotated[
        str, typer.Argument(metavar="[FILE|-]", help="Where --write-udev writes; -: stdout.")
    ] = "-",
    rig: RigFile = None,
    assignments: Assignments = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Measure for 2 s instead of 10 s.")
    ] = False,
    out: Annotated[
        Path, typer.Option(help="Where runs will be written: the disk that is timed.")
    ] = Path("runs"),
    as_json: AsJson = False,
    write_udev: Annotated[
        bool,
        typer.Option(
            "--write-udev",
            help="Only print udev rules for the devices that are connected: stable names, access "
            "for their groups.",
        ),
    ] = False,
) -> None:
    """Check this machine and, with --rig, the rig's camera and arm. Nothing moves.

    Each check is a row: ok, warn or fail, what was measured, and what to do. Without --rig the
    simulated rig is checked. It takes about a minute; the first time longer, because the image
    kernels are compiled.
    """
    if write_udev:
        _write_rules(file)
        return
    if file != "-":
        raise ConfigError(
            f"{file}: a file is for --write-udev; a rig file is given as --rig {file}"
        )
    from rig.config_load import load_config
    from rig.doctor.subject import Subject
    from rig.stop_request import StopRequest

    config = load_config("sphere", rig, assignments)
    subject = Subject(config, out.absolute(), quick, rig_file=rig)
    with StopRequest("stopping …") as stop_requested:
        findings = _examine(subject, stop_requested)
        interrupted = stop_requested()
    _show(findings, interrupted, as_json)
    if interrupted:
        raise typer.Exit(ExitCode.INTERRUPTED)
    if any(finding.status == "fail" for finding in findings):
        raise typer.Exit(ExitCode.DEVICE)


def _examine(subject: "Subject", stop_requested: Callable[[], bool]) -> "list[Finding]":
    """Run the checks, saying on a terminal's stderr what is being done."""
    from drivers.clock import WallClock
    from rig.doctor.checks import checks_for
    from rig.doctor.runner import run_checks
    from rig.doctor.table import title_of

    console = Console(stderr=True)
    # Drawn rarely, so that it does not disturb what is being measured.
    status = console.status("starting", refresh_per_second=2) if console.is_terminal else None
    with status or nullcontext():

        def begin(name: str) -> None:
            if status is not None:
                status.update(f"checking: {title_of(name)}")

        checks = checks_for(subject)
        return list(run_checks(subject, checks, WallClock(), begin, stop_requested))


def _show(findings: "list[Finding]", interrupted: bool, as_json: bool) -> None:
    from rig.doctor.table import sum_up, table_of

    ok = not interrupted and all(finding.status != "fail" for finding in findings)
    if as_json:
        rows = [finding.as_json() for finding in findings]
        print(json.dumps({"ok": ok, "interrupted": interrupted, "checks": rows}), flush=True)
    console = Console(stderr=as_json)
    console.print(table_of(findings))
    console.print(sum_up(findings, interrupted), highlight=False)


def _write_rules(file: str) -> None:
    """To standard output, or to a file that did not exist or may be replaced."""
    from rig.doctor.node_tree import find_nodes
    from rig.doctor.udev import RULES_FILE, rules_for

    nodes = [*find_nodes("video4linux"), *find_nodes("tty")]
    rules = rules_for(nodes)
    if file == "-":
        sys.stdout.write(rules)
        return
    try:
        Path(file).write_text(rules, encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            f"cannot write {file}: {error.strerror}; type: rig doctor --write-udev - | "
            f"sudo tee {RULES_FILE}"
        ) from error
    warn(f"written: {file}. Activate: sudo udevadm control --reload && sudo udevadm trigger")
