"""What the control loop hands over: the objects themselves, to be put into bytes elsewhere."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState, Frame
from estimator.estimate import Estimate
from rig.vision import Sighting

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class States:
    """Arm samples that were read together, and the number of that reading."""

    states: tuple[ArmState, ...]
    read: int


@dataclass(frozen=True, slots=True)
class Seen:
    """One image's measurement."""

    sighting: Sighting
    handled_s: float


@dataclass(frozen=True, slots=True)
class Picture:
    """One image itself."""

    frame: Frame


@dataclass(frozen=True, slots=True)
class Estimated:
    """A state after an image, or predicted to a tick."""

    kind: str  # "update" or "estimate"
    estimate: Estimate


@dataclass(frozen=True, slots=True)
class Commanded:
    """One tick's tool twists."""

    t_s: float
    commanded: FloatArray  # (6,)
    allowed: FloatArray  # (6,)
    measured: FloatArray  # (6,)
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Ticked:
    """One tick of the loop."""

    t_s: float
    late_s: float
    overruns: int


@dataclass(frozen=True, slots=True)
class Happened:
    """An event."""

    t_s: float
    name: str
    detail: str


@dataclass(frozen=True, slots=True)
class Attached:
    """A file that is part of what was recorded."""

    name: str
    data: bytes


Entry = Attached | States | Seen | Picture | Estimated | Commanded | Ticked | Happened
