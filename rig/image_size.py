"""Pictures must have the size that the camera's intrinsics hold for."""

from drivers.interfaces import Camera, Frame
from rig.calibration.errors import UnusableCalibrationError
from rig.vision.sighting import Sighting, Vision

Size = tuple[int, int]  # width, height


def check_size(frame: Frame, size_px: Size) -> None:
    """Raise UnusableCalibrationError when the frame's picture is of another size."""
    height, width = frame.image.shape
    if (width, height) != size_px:
        wanted = f"{size_px[0]}x{size_px[1]}"
        raise UnusableCalibrationError(
            f"the camera delivers {width}x{height} px, the intrinsics in use hold for {wanted} px: "
            f"set camera.width and camera.height to {size_px[0]} and {size_px[1]}, or calibrate "
            "in this mode: `rig calibrate`, from its first step (intrinsics) on"
        )


class SizedVision:
    """Vision that refuses pictures of another size: the first one before there is an estimate."""

    def __init__(self, vision: Vision, size_px: Size) -> None:
        self._vision = vision
        self._size_px = size_px

    def poll(self) -> list[Sighting]:
        """Sightings, see ``Vision``; raises UnusableCalibrationError."""
        sightings = self._vision.poll()
        for sighting in sightings:
            check_size(sighting.frame, self._size_px)
        return sightings

    def problem(self) -> str | None:
        """What the camera complains about."""
        return self._vision.problem()

    def close(self) -> None:
        """Release the camera."""
        self._vision.close()


class SizedCamera:
    """A camera that refuses pictures of another size."""

    def __init__(self, camera: Camera, size_px: Size) -> None:
        self._camera = camera
        self._size_px = size_px

    def read(self, timeout_s: float) -> Frame | None:
        """The newest frame, see ``Camera``; raises UnusableCalibrationError."""
        frame = self._camera.read(timeout_s)
        if frame is not None:
            check_size(frame, self._size_px)
        return frame

    def close(self) -> None:
        """Release the camera."""
        self._camera.close()
