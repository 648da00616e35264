"""Vision in the control loop's own thread: for simulated time."""

from drivers.interfaces import Camera
from estimator.image.tracker import TargetTracker
from rig.vision.sighting import Sighting, camera_problem


class InlineVision:
    """Measures during ``poll``: deterministic."""

    def __init__(self, camera: Camera, tracker: TargetTracker) -> None:
        self._camera = camera
        self._tracker = tracker

    def poll(self) -> list[Sighting]:
        """Measure the newest frame, if there is one that was not measured before."""
        frame = self._camera.read(timeout_s=0.0)
        if frame is None:
            return []
        return [Sighting(frame, self._tracker.measure(frame.image))]

    def problem(self) -> str | None:
        """What the camera complains about."""
        return camera_problem(self._camera)

    def close(self) -> None:
        """Release the camera."""
        self._camera.close()
