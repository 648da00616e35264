"""Vision in a thread of its own: control never waits for an image, only for the interpreter."""

import threading
from collections import deque

from drivers.errors import RigError
from drivers.interfaces import Camera
from estimator.image.tracker import TargetTracker
from rig.vision.sighting import READ_TIMEOUT_S, Sighting, camera_problem


class ThreadedVision:
    """Reads and measures in a thread that the first ``poll`` starts."""

    def __init__(self, camera: Camera, tracker: TargetTracker) -> None:
        self._camera = camera
        self._tracker = tracker
        self._sightings: deque[Sighting] = deque(maxlen=64)
        self._error: BaseException | None = None
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def poll(self) -> list[Sighting]:
        """Take what the thread has finished."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="vision", daemon=True)
            self._thread.start()
        if self._error is not None:
            raise self._error
        out: list[Sighting] = []
        while self._sightings:
            out.append(self._sightings.popleft())
        return out

    def problem(self) -> str | None:
        """What the camera complains about."""
        return camera_problem(self._camera)

    def close(self) -> None:
        """End the thread after the frame it is working on, then release the camera."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join(timeout=5.0)
        self._camera.close()

    def _work(self) -> None:
        try:
            while not self._closing.is_set():
                frame = self._camera.read(timeout_s=READ_TIMEOUT_S)
                if frame is not None:
                    self._sightings.append(Sighting(frame, self._tracker.measure(frame.image)))
        except RigError as error:
            self._error = error
        except BaseException as error:
            # Whatever it was belongs to the control thread, which stops the arm on it.
            self._error = error
            raise
