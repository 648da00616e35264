"""The way in: settings to an open camera, whatever its source."""

from typing import Protocol

from drivers.camera.health import CameraHealth
from drivers.camera.live import OpenCvCamera
from drivers.camera.replay import ReplayCamera
from drivers.camera.settings import CameraSettings
from drivers.camera.source import SourceKind, parse_source
from drivers.clock import Clock
from drivers.interfaces import Camera, Frame


class WatchedCamera(Camera, Protocol):
    """A camera that also tells how it fares and can wait for a picture taken from now on."""

    def read_after(self, t_s: float, timeout_s: float) -> Frame | None:
        """The newest frame whose exposure began after ``t_s``; None when none comes in time."""
        ...

    def health(self) -> CameraHealth:
        """State, problem in words, rates and counts."""
        ...


def open_camera(settings: CameraSettings, clock: Clock) -> WatchedCamera:
    """Open the camera that ``settings.source`` names.

    A device or stream needs the machine's monotonic clock; a recording plays on any. Raises
    ConfigError for a source that is none, ConnectError for one that cannot be opened or does
    not do what is asked.
    """
    if parse_source(settings.source).kind in (SourceKind.FILE, SourceKind.IMAGES):
        return ReplayCamera(settings, clock)
    return OpenCvCamera(settings, clock)
