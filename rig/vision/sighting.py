"""What vision delivers, whoever does the work."""

from dataclasses import dataclass
from typing import Protocol

from drivers.interfaces import Camera, Frame
from estimator.image.feature import Measurement

# Long enough to wait without burning the processor, short enough to end promptly.
READ_TIMEOUT_S = 0.1


@dataclass(frozen=True, slots=True)
class Sighting:
    """One frame and what was measured in it."""

    frame: Frame
    measurement: Measurement


class Vision(Protocol):
    """Turns the camera's frames into sightings, from the first ``poll`` on."""

    def poll(self) -> list[Sighting]:
        """Sightings since the last call, oldest first; raises what the camera raised."""
        ...

    def problem(self) -> str | None:
        """Why the camera delivers nothing right now, in words; None while all is well."""
        ...

    def close(self) -> None:
        """Stop measuring and release the camera; harmless when repeated."""
        ...


def camera_problem(camera: Camera) -> str | None:
    """What a camera that watches its own health complains about."""
    health = getattr(camera, "health", None)
    return None if health is None else health().problem
