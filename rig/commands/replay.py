"""``rig replay``: a recorded run again, offline: the same, or with other settings."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
import yaml
from rich.console import Console

from rig.commands.options import AsJson, Assignments, warn
from rig.exit_codes import ExitCode

if TYPE_CHECKING:
    from rig.replay.engine import Replay
    from rig.replay.recording import Recording


def replay(
    log: Annotated[
        Path, typer.Argument(metavar="LOG", help="A log.mcap, or the run directory that holds one.")
    ],
    assignments: Assignments = None,
    source: Annotated[
        Literal["features", "images"],
        typer.Option("--from", help="Use the recorded features, or measure the images anew."),
    ] = "features",
    sweep: Annotated[
        str | None,
        typer.Option(
            metavar="KEY=V1,V2,...",
            help="Replay once for each value: a table, a plot; default: once, as it was recorded.",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(help="Where the plot of --sweep goes; default: a PNG beside the log."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run a recording through the live code: image, feature, estimator.

    Without --set the estimates are those of the run, bit for bit, and that is checked. With it
    they answer "what if": another gain, method or latency, on the same motion and images. --json
    has the keys of `rig run --json`; with --sweep it is one line a value, with the value's key.

    Exit codes: 0 a radius was obtained, 2 wrong usage or a log that cannot be replayed, 4 no
    radius.
    """
    from rig.replay.recording import open_recording

    recording = open_recording(log)
    if not recording.log.finished:
        warn("the log was never closed: the replay ends where its writer was stopped")
    if sweep is not None:
        _sweep(recording, sweep, list(assignments or []), source, plot, as_json)
        return
    if plot is not None:
        warn("--plot goes with --sweep: nothing is drawn")
    _one(recording, list(assignments or []), source, as_json)


def _one(
    recording: "Recording",
    assignments: list[str],
    source: Literal["features", "images"],
    as_json: bool,
) -> None:
    from rig.replay.engine import replay as run_again
    from rig.summary import JSON_KEYS
    from rig.summary_table import table

    done = run_again(recording, assignments, source)
    if as_json:
        print(json.dumps({key: done.summary[key] for key in JSON_KEYS}), flush=True)
    Console(stderr=as_json).print(table(done.summary))
    _explain(recording, done, source, changed=bool(assignments))
    if done.summary["radius_m"] is None:
        raise typer.Exit(ExitCode.TARGET_LOST)


def _sweep(
    recording: "Recording",
    text: str,
    assignments: list[str],
    source: Literal["features", "images"],
    plot: Path | None,
    as_json: bool,
) -> None:
    from rig.replay.sweep import draw_sweep, parse_sweep, sweep, sweep_table
    from rig.summary import JSON_KEYS

    key, values = parse_sweep(text)
    points = sweep(recording, key, values, assignments, source)
    if as_json:
        for point in points:
            found = {name: point.replay.summary[name] for name in JSON_KEYS}
            print(json.dumps({key: yaml.safe_load(point.value), **found}), flush=True)
    console = Console(stderr=as_json)
    console.print(sweep_table(key, points))
    path = recording.log.path.parent / f"sweep-{key}.png" if plot is None else plot
    draw_sweep(path, key, points)
    console.print(f"plot: {path}", highlight=False)


def _explain(recording: "Recording", done: "Replay", source: str, changed: bool) -> None:
    from rig.replay.compare import first_difference

    if done.images_missing:
        warn(
            f"{done.images_missing} of {done.outcome.data.frames} images are not in the log: their "
            "recorded features were used"
        )
    if done.story.error:
        warn(f"the run failed: {done.story.error}")
    if done.outcome.error is not None:
        warn(f"error: {done.outcome.error}")
    if changed:
        return
    difference = first_difference(done.recorded, done.replayed, not recording.log.finished)
    if difference and source == "images" and done.config.log.images == "jpeg":
        warn(f"the images were recorded as JPEG, which does not keep every bit: {difference}")
    elif difference:
        warn(f"differs from the run (activerig {recording.version}): {difference}")
    else:
        count = len(done.replayed.updates)
        warn(f"identical to the run: {count} estimates and their predictions, every bit")
