"""Who watches a calibration, and who may end it."""

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

from rig.calibration.pose_planning import PlannedPose


@dataclass(frozen=True, slots=True)
class PoseReport:
    """What became of one planned pose."""

    number: int  # of the pose, from 1
    wanted: int
    pose: PlannedPose
    problem: str  # why it was skipped, or ""


class Progress(Protocol):
    """Whoever watches a calibration."""

    def step(self, name: str, detail: str, total: float | None = None) -> None:
        """A step begins; ``total`` is what ``done`` counts up to, None: nobody knows."""
        ...

    def done(self, count: float) -> None:
        """So much of the step is done."""
        ...

    def pose(self, report: PoseReport) -> None:
        """A planned pose was looked from, or skipped."""
        ...

    def note(self, text: str) -> None:
        """Something worth a line."""
        ...


class Stop(Protocol):
    """Whether somebody asked to stop; ``rig.stop_request`` has one for Ctrl-C."""

    def __call__(self) -> bool:
        """Whether a stop was asked for; asked at every tick while anything moves."""
        ...

    def at_once(self) -> AbstractContextManager[None]:
        """Around long calculations: a stop raises KeyboardInterrupt there."""
        ...
