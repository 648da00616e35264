"""Reads a run directory back, as far as the run came."""

from pathlib import Path

import numpy as np

from estimator.image.feature import Feature
from rig.log.reader import Log
from rig.recorded.pictures import IMAGE_KINDS, loader
from rig.recorded.record import Command, FrameEntry, Picture, RunRecord
from rig.recorded.setup import read_setup
from rig.recorded.summary import read_summary
from rig.replay.recording import Estimated, Event, Seen, States, Tick, open_recording
from rig.run_data import RunData


def read_run(run_dir: Path) -> RunRecord:
    """Read one run, as far as it came.

    Raises ConfigError for a directory that holds no run, or one that this version cannot read.
    """
    setup = read_setup(run_dir)
    recording = open_recording(run_dir)
    data = RunData(setup.target, setup.T_tool_camera)
    seen: list[Seen] = []
    ticks: list[Tick] = []
    events: list[Event] = []
    for step in recording.steps(images=False):
        if isinstance(step, States):
            data.arm_states.extend(step.states)
        elif isinstance(step, Seen):
            seen.append(step)
            data.add_frame(step.sighting.frame.seq, step.sighting.measurement.found)
        elif isinstance(step, Tick):
            ticks.append(step)
        elif isinstance(step, Event):
            events.append(step)
        elif isinstance(step, Estimated) and step.kind == "update":
            data.updates.append(step.estimate)
    config = recording.config()
    data.features = _features(data, seen, config.calibration.latency_s)
    commands, pictures = _rest(recording.log, seen, config.calibration.latency_s)
    return RunRecord(
        directory=run_dir,
        setup=setup,
        config=config,
        summary=read_summary(run_dir),
        data=data,
        frames=tuple(_frame(one) for one in seen),
        ticks=tuple(ticks),
        commands=commands,
        events=tuple(events),
        pictures=pictures,
    )


def _rest(
    log: Log, seen: list[Seen], stamps_late_s: float
) -> tuple[tuple[Command, ...], tuple[Picture, ...]]:
    """What a replay does not need: the commands, and where the images are."""
    commands: list[Command] = []
    pictures: list[Picture] = []
    frames = 0
    for record in log.records(["frame", "command", *IMAGE_KINDS]):
        if record.kind == "frame":
            frames += 1
        elif record.kind == "command":
            values = record.values()
            commands.append(
                Command(
                    t_s=values["t_s"],
                    commanded=np.array(values["commanded"]),
                    allowed=np.array(values["allowed"]),
                    measured=np.array(values["measured"]),
                    reasons=tuple(values["reasons"]),
                )
            )
        elif 0 < frames <= len(seen):  # an image follows what was measured in it
            sighting = seen[frames - 1].sighting
            t_s = sighting.frame.t_exposure_mid_s - stamps_late_s
            feature = sighting.measurement.feature
            pictures.append(Picture(t_s, feature, loader(log, record)))
    return tuple(commands), tuple(pictures)


def _features(data: RunData, seen: list[Seen], stamps_late_s: float) -> list[Feature]:
    """What each update was made from: the feature that was exposed at its very instant."""
    exposed = {
        one.sighting.frame.t_exposure_mid_s - stamps_late_s: one.sighting.measurement.feature
        for one in seen
    }
    found = [exposed.get(update.t_s) for update in data.updates]
    features = [feature for feature in found if feature is not None]
    return features if len(features) == len(found) else []


def _frame(seen: Seen) -> FrameEntry:
    frame = seen.sighting.frame
    reason = seen.sighting.measurement.reason
    return FrameEntry(frame.t_exposure_mid_s, seen.handled_s, frame.seq, reason)
