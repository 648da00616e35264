"""A past run in memory, whatever format it was recorded in."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import GreyImage
from estimator.image.feature import Feature
from rig.config import RigConfig
from rig.recorded.setup import RunSetup
from rig.records import Json
from rig.replay.recording import Event, Tick
from rig.run_data import RunData

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FrameEntry:
    """One received image, as the log has it."""

    t_s: float  # the camera's stamp of the exposure
    handled_s: float  # when the control loop took it
    seq: int
    reason: str  # why nothing was measured in it, or ""


@dataclass(frozen=True, slots=True)
class Command:
    """One control tick's tool twists, (6,) each."""

    t_s: float
    commanded: FloatArray
    allowed: FloatArray
    measured: FloatArray
    reasons: tuple[str, ...]  # why less was allowed than commanded


@dataclass(frozen=True, slots=True)
class Picture:
    """One recorded image; it is decoded only when somebody asks for it."""

    t_s: float  # of its exposure
    feature: Feature | None
    load: Callable[[], GreyImage]


@dataclass(frozen=True, slots=True)
class RunRecord:
    """Everything a run left behind, all times on the run's own clock."""

    directory: Path
    setup: RunSetup
    config: RigConfig
    summary: Mapping[str, Json] | None  # None: the run was cut off
    data: RunData  # arm states and updates; no snapshots
    frames: tuple[FrameEntry, ...]
    ticks: tuple[Tick, ...]
    commands: tuple[Command, ...]
    events: tuple[Event, ...]
    pictures: tuple[Picture, ...]  # by time; none where images were not recorded

    @property
    def start_s(self) -> float:
        """The exposure of the first image used, which figures count from; else the first entry."""
        if self.data.updates:
            return self.data.updates[0].t_s
        return self.events[0].t_s if self.events else 0.0
