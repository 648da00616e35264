"""``rig log``: what is in a recording, as tables, and repaired."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.console import Console
from rich.table import Table

from rig.exit_codes import PLAIN

if TYPE_CHECKING:
    from rig.log.info import LogInfo
    from rig.log.repair import Repair

log_app = typer.Typer(
    no_args_is_help=True, help="Look into the log of a run, export it, repair it."
)
LogFile = Annotated[
    Path, typer.Argument(metavar="LOG", help="A log.mcap, or the run directory that holds one.")
]


@log_app.command(epilog=PLAIN)
def info(
    log: LogFile,
    as_json: Annotated[bool, typer.Option("--json", help="JSON on stdout.")] = False,
) -> None:
    """What a log holds: the run, its channels, and whether it was closed in order."""
    from rig.log.info import describe
    from rig.log.reader import open_log

    found = describe(open_log(log))
    if as_json:
        print(json.dumps(found.as_dict()))
        return
    _show(found)


@log_app.command(epilog=PLAIN)
def export(
    log: LogFile,
    fmt: Annotated[
        Literal["csv", "jsonl", "parquet"],
        typer.Option("--format", help="One file a kind of record, or one of JSON lines."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="The directory; default: export, beside the log."),
    ] = None,
) -> None:
    """Write a log's records as tables; arrays become one column an element."""
    from rig.log.export import export as write
    from rig.log.reader import open_log

    found = open_log(log)
    to = found.path.parent / "export" if out is None else out
    for name, rows in write(found, to, fmt).items():
        print(f"{to / name}: {rows} rows")
    if not found.finished:
        typer.echo("the log was never closed: it ends where its writer was stopped", err=True)


@log_app.command(epilog=PLAIN)
def repair(
    log: LogFile,
    out: Annotated[
        Path | None, typer.Option(help="The file to write; default: in the log's place.")
    ] = None,
) -> None:
    """Rebuild the index of a log whose writer was killed, keeping all that can be read."""
    from rig.log.repair import repair as rebuild

    print(_said(rebuild(log, out)))


def _said(done: "Repair") -> str:
    if not done.needed:
        return f"{done.path} is whole: nothing to repair"
    text = f"{done.path}: {done.messages} messages, a new index"
    text += f"; {done.lost_bytes} bytes of an unfinished record left out" if done.lost_bytes else ""
    return text + (
        f"; {done.damaged_chunks} damaged chunks left out" if done.damaged_chunks else ""
    )


def _show(found: "LogInfo") -> None:
    values, console = found.as_dict(), Console()
    run, program = values["run"], values["program"]
    state = "closed in order"
    if not values["finished"]:
        state = "never closed: `rig log repair` adds the index"
    said = [f"{values['bytes'] / 1e6:.1f} MB, {values['duration_s']:.1f} s, {state}"]
    if run:
        said.append(
            f"{run.get('target')} on the rig {run.get('rig')}, seed {run.get('seed')}, "
            f"written by activerig {program.get('version')}"
        )
    if values["damaged_chunks"]:
        said.append(f"{values['damaged_chunks']} damaged chunks are left out")
    said.append("attached: " + (", ".join(values["attachments"]) or "nothing"))
    console.print(str(found.log.path), *said, sep="\n", highlight=False, markup=False)
    table = Table("channel", "schema", "messages", "per second", "MB")
    for one in found.channels:
        rate = one.count / found.duration_s if found.duration_s > 0 else 0.0
        table.add_row(
            one.topic, one.schema, str(one.count), f"{rate:.1f}", f"{one.bytes / 1e6:.2f}"
        )
    console.print(table)
