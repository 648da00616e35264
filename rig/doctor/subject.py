"""What is examined, in a form that goes from process to process."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.config import RigConfig


@dataclass(frozen=True, slots=True)
class Subject:
    """A rig on this machine."""

    config: RigConfig
    runs: Path  # where runs will be written; need not exist
    quick: bool = False  # shorter measurements
    root: Path = Path("/")  # of /proc, /sys, /dev and /etc
    rig_file: Path | None = None  # which ``config`` was read from

    @property
    def hardware(self) -> bool:
        """Whether the rig has real devices."""
        return self.config.arm.driver != "sim" or self.config.camera.driver != "sim"

    def as_json(self) -> dict[str, Any]:
        """The subject as plain data."""
        return {
            "config": self.config.model_dump(mode="json"),
            "runs": str(self.runs),
            "quick": self.quick,
            "root": str(self.root),
            "rig_file": None if self.rig_file is None else str(self.rig_file),
        }


def subject_of(data: dict[str, Any]) -> Subject:
    """The inverse of ``Subject.as_json``."""
    return Subject(
        config=RigConfig.model_validate(data["config"]),
        runs=Path(data["runs"]),
        quick=bool(data["quick"]),
        root=Path(data["root"]),
        rig_file=None if data["rig_file"] is None else Path(data["rig_file"]),
    )
