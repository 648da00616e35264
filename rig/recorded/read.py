"""Reads a run directory; the only module that knows the format of its log."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from drivers.errors import ConfigError
from drivers.interfaces import ArmState
from estimator.estimate import Estimate
from rig.config_load import load_config
from rig.recorded.pictures import read_pictures
from rig.recorded.record import Command, Event, FrameEntry, RunRecord
from rig.recorded.setup import read_setup
from rig.records import LOG_NAME, SUMMARY_NAME, Json
from rig.run_data import RunData

Entry = dict[str, Any]


def read_run(run_dir: Path) -> RunRecord:
    """Read one run, as far as it came.

    Raises ConfigError for a directory that holds no run, or one that this version cannot read.
    """
    setup = read_setup(run_dir)
    config = load_config(setup.target, run_dir / "config.yaml")
    data = RunData(setup.target, setup.T_tool_camera)
    frames: list[FrameEntry] = []
    commands: list[Command] = []
    events: list[Event] = []
    path = run_dir / LOG_NAME
    try:
        for entry in _entries(path):
            kind = entry["kind"]
            if kind == "arm":
                data.arm_states.append(_arm_state(entry))
            elif kind == "update":
                data.updates.append(_estimate(entry))
            elif kind == "frame":
                frames.append(_frame(entry))
                data.add_frame(entry["seq"], entry["s"] is not None)
            elif kind == "command":
                commands.append(_command(entry))
            elif kind == "event":
                events.append(Event(entry["t_s"], entry["event"], entry["detail"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path} cannot be read: {error!r}") from error
    return RunRecord(
        directory=run_dir,
        setup=setup,
        config=config,
        summary=read_summary(run_dir),
        data=data,
        frames=tuple(frames),
        commands=tuple(commands),
        events=tuple(events),
        pictures=read_pictures(run_dir),
    )


def read_summary(run_dir: Path) -> dict[str, Json] | None:
    """``summary.json``, or None when the run never got that far or it was cut off in writing."""
    try:
        summary = json.loads((run_dir / SUMMARY_NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return summary if isinstance(summary, dict) else None


def _entries(path: Path) -> list[Entry]:
    """The log's lines; a last one that a killed run left unfinished is dropped."""
    lines = path.read_text(encoding="utf-8", errors="replace").split("\n")
    entries = []
    for number, line in enumerate(lines):
        if not line:
            continue
        try:
            entries.append(json.loads(line))
        except ValueError:
            if number == len(lines) - 1:
                break
            raise
    return entries


def _arm_state(entry: Entry) -> ArmState:
    T = np.eye(4)
    T[:3] = entry["T_base_tool"]
    return ArmState(entry["t_s"], T, np.array(entry["twist_tool"]))


def _estimate(entry: Entry) -> Estimate:
    axis = entry["axis"]
    return Estimate(
        t_s=entry["t_s"],
        s=np.array(entry["s"]),
        axis=None if axis is None else np.array(axis),
        chi=entry["chi"],
        variance=entry.get("variance"),
        residual=entry["residual"],
        extrapolated_s=entry["extrapolated_s"],
    )


def _frame(entry: Entry) -> FrameEntry:
    return FrameEntry(entry["t_s"], entry["handled_s"], entry["seq"], entry["reason"])


def _command(entry: Entry) -> Command:
    return Command(
        t_s=entry["t_s"],
        commanded=np.array(entry["commanded"]),
        allowed=np.array(entry["allowed"]),
        measured=np.array(entry["measured"]),
        reasons=tuple(entry["reasons"]),
    )
