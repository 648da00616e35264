"""A camera whose stamps are moved by a constant: to correct them, or to make them wrong."""

from dataclasses import replace

from drivers.interfaces import Camera, Frame


class Restamped:
    """``camera``, each of its frames' instants ``offset_s`` later."""

    def __init__(self, camera: Camera, offset_s: float) -> None:
        self._camera = camera
        self._offset_s = offset_s

    def read(self, timeout_s: float) -> Frame | None:
        """The camera's next frame, its stamp moved."""
        frame = self._camera.read(timeout_s)
        if frame is None:
            return None
        return replace(frame, t_exposure_mid_s=frame.t_exposure_mid_s + self._offset_s)

    def close(self) -> None:
        """Close the camera."""
        self._camera.close()
