"""How a run goes and how it ended: what the loop tells those who watch and those who sum up."""

from dataclasses import dataclass
from enum import Enum

from drivers.errors import RigError
from drivers.interfaces import ArmState
from estimator.estimate import Estimate
from rig.run_data import RunData
from rig.schedule import TickStats
from rig.vision import Sighting


class Ending(Enum):
    """Why a run ended."""

    TIME = "duration reached"
    CONVERGED = "converged"
    INTERRUPTED = "interrupted"
    TARGET_LOST = "target lost"
    SAFETY_STOP = "safety stop"
    DEVICE_FAILURE = "device failure"


@dataclass(frozen=True, slots=True)
class LiveStatus:
    """What a person watching wants to know, once a tick."""

    elapsed_s: float  # since the loop started
    state: str  # the supervisor's, with its reason
    estimate: Estimate | None
    target_state: str  # "searching: …", "tracking", "lost: …"
    frames: int
    frames_lost: int
    ticks: int
    overruns: int
    speed_m_s: float  # measured, of the camera
    limited_by: tuple[str, ...]
    remaining_fraction: float  # of the observer's transient, or of R half the 95 % interval
    late_s: float  # by which the newest tick began after its point on the grid
    arm: ArmState | None  # its newest sample
    sighting: Sighting | None  # the newest image and what was measured in it
    servo: str = ""  # how far a servo is from where it has to get


@dataclass(frozen=True, slots=True)
class RunOutcome:
    """How a run went; ``error`` is set when a device or the safety ended it."""

    ending: Ending
    data: RunData
    stats: TickStats
    started_s: float
    ended_s: float
    at_rest: bool
    remaining_fraction: float
    target_state: str
    holds: int  # how often the arm was held for a while
    last_hold: str  # why it was held last, or ""
    error: RigError | None
