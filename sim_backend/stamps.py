"""When the simulated camera says a frame was exposed: rightly, or as far as a driver can tell."""

from drivers.camera.restamped import Restamped
from drivers.interfaces import Camera
from sim_backend.config import CameraConfig


def stamped(camera: Camera, config: CameraConfig) -> Camera:
    """``camera``, whose stamps are true, with the stamps that the configuration asks for.

    With ``stamps: arrival`` they lie ``latency_s`` late: on the regular grid that a driver finds
    behind the jitter of the arrivals when nothing tells it how old a frame is by then.
    """
    return camera if config.stamps == "exposure" else Restamped(camera, config.latency_s)
