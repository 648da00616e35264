"""Where images become measurements: in the control loop's own thread, or in one of their own."""

import threading
from collections import deque
from dataclasses import dataclass
from typing import Protocol

from drivers.errors import RigError
from drivers.interfaces import Camera, Frame
from estimator.image.feature import Measurement
from estimator.image.tracker import TargetTracker

# Long enough to wait without burning the processor, short enough to end promptly.
_READ_TIMEOUT_S = 0.1


@dataclass(frozen=True, slots=True)
class Sighting:
    """One frame and what was measured in it."""

    frame: Frame
    measurement: Measurement


class Vision(Protocol):
    """Turns the camera's frames into sightings."""

    def poll(self) -> list[Sighting]:
        """Sightings since the last call, oldest first; raises what the camera raised."""
        ...

    def close(self) -> None:
        """Stop measuring; the camera itself stays open."""
        ...


class InlineVision:
    """Measures during ``poll``: deterministic, for simulated time."""

    def __init__(self, camera: Camera, tracker: TargetTracker) -> None:
        self._camera = camera
        self._tracker = tracker

    def poll(self) -> list[Sighting]:
        """Measure the newest frame, if there is one that was not measured before."""
        frame = self._camera.read(timeout_s=0.0)
        if frame is None:
            return []
        return [Sighting(frame, self._tracker.measure(frame.image))]

    def close(self) -> None:
        """Nothing runs between polls."""


class ThreadedVision:
    """Reads and measures in a thread of its own, so that control never waits for an image."""

    def __init__(self, camera: Camera, tracker: TargetTracker) -> None:
        self._camera = camera
        self._tracker = tracker
        self._sightings: deque[Sighting] = deque(maxlen=64)
        self._error: BaseException | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._work, name="vision", daemon=True)
        self._thread.start()

    def poll(self) -> list[Sighting]:
        """Take what the thread has finished."""
        if self._error is not None:
            raise self._error
        out: list[Sighting] = []
        while self._sightings:
            out.append(self._sightings.popleft())
        return out

    def close(self) -> None:
        """End the thread after the frame it is working on."""
        self._closing.set()
        self._thread.join(timeout=5.0)

    def _work(self) -> None:
        try:
            while not self._closing.is_set():
                frame = self._camera.read(timeout_s=_READ_TIMEOUT_S)
                if frame is not None:
                    self._sightings.append(Sighting(frame, self._tracker.measure(frame.image)))
        except RigError as error:
            self._error = error
        except BaseException as error:
            # Whatever it was belongs to the control thread, which stops the arm on it.
            self._error = error
            raise
