"""Vision without images: what measuring them would have found, from the simulator itself."""

from collections.abc import Callable

from drivers.interfaces import Camera
from estimator.image.feature import Feature, Measurement
from rig.vision.sighting import Sighting, camera_problem

# What the image of that instant and number shows, or why it shows nothing.
Look = Callable[[float, int], Feature | str]


class FeatureVision:
    """Takes a camera's frames for their times only, stamped ``stamps_late_s`` late."""

    def __init__(self, camera: Camera, look: Look, stamps_late_s: float) -> None:
        self._camera = camera
        self._look = look
        self._stamps_late_s = stamps_late_s

    def poll(self) -> list[Sighting]:
        """The newest frame, if there is a new one, and what it would have shown."""
        frame = self._camera.read(timeout_s=0.0)
        if frame is None:
            return []
        found = self._look(frame.t_exposure_mid_s - self._stamps_late_s, frame.seq)
        seen = Measurement(None, found) if isinstance(found, str) else Measurement(found)
        return [Sighting(frame, seen)]

    def problem(self) -> str | None:
        """What the camera complains about."""
        return camera_problem(self._camera)

    def close(self) -> None:
        """Release the camera."""
        self._camera.close()
