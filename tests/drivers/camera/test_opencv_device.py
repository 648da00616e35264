"""OpenCV's own stream reader (FFmpeg, as for RTSP) and the choice between access paths."""

from collections.abc import Iterator

import pytest

from drivers.camera import linuxpy_device
from drivers.camera.device import CameraLost, Mode
from drivers.camera.live import OpenCvCamera
from drivers.camera.opencv_device import OpenCvDevice
from drivers.camera.settings import CameraSettings
from drivers.camera.source import Source, SourceKind
from drivers.clock import WallClock
from drivers.errors import ConnectError
from sim_backend.loopback_camera.server import MjpegServer
from tests.drivers.camera.streams import HEIGHT, WIDTH, TickingCamera

pytestmark = pytest.mark.realtime

CLOCK = WallClock()


@pytest.fixture
def server() -> Iterator[MjpegServer]:
    with MjpegServer(TickingCamera().read) as serving:
        yield serving


def through_ffmpeg(url: str) -> OpenCvDevice:
    return OpenCvDevice(Source(SourceKind.STREAM, url), CLOCK, 1)


def test_a_stream_comes_grey_and_without_stamps(server: MjpegServer) -> None:
    device = through_ffmpeg(server.url)
    mode = device.set_mode(Mode(), 2)
    grab = device.grab()
    device.release()
    assert (mode.width, mode.height, mode.rate_hz) == (WIDTH, HEIGHT, None)
    assert grab.image is not None and grab.image.shape == (HEIGHT, WIDTH)
    assert grab.stamp_s is None


def test_its_frames_are_stamped_on_arrival(server: MjpegServer) -> None:
    settings = CameraSettings(rate_check_s=0.2, max_identical=None)
    camera = OpenCvCamera(settings, CLOCK, lambda: through_ffmpeg(server.url))
    try:
        frame = camera.read(2.0)
        assert frame is not None
        assert frame.stamp_source == "host"
    finally:
        camera.close()


def test_a_stream_that_ends_is_lost_and_one_that_is_not_there_cannot_be_opened(
    server: MjpegServer,
) -> None:
    device = through_ffmpeg(server.url)
    device.grab()
    server.inject("camera_unplug")
    with pytest.raises(CameraLost):
        for _ in range(50):
            device.grab()
    device.release()
    with pytest.raises(ConnectError, match="cannot be opened"):
        through_ffmpeg(server.url)


def test_linuxpy_is_used_where_installed_and_missing_only_where_demanded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(linuxpy_device, "find_spec", lambda name: None)
    assert not linuxpy_device.linuxpy_wanted("auto")
    with pytest.raises(ConnectError, match="pip install"):
        linuxpy_device.linuxpy_wanted("linuxpy")
    monkeypatch.setattr(linuxpy_device, "find_spec", lambda name: object())
    assert linuxpy_device.linuxpy_wanted("auto")
    assert linuxpy_device.linuxpy_wanted("linuxpy")
    assert not linuxpy_device.linuxpy_wanted("opencv")
