"""The loopback stream and its faults, seen by the true driver."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from drivers.camera.live import OpenCvCamera
from drivers.camera.settings import CameraSettings
from drivers.clock import WallClock
from drivers.errors import ConnectError, OperateError
from drivers.interfaces import Frame
from sim_backend.loopback_camera.server import MjpegServer
from tests.drivers.camera.streams import TickingCamera, noisy

pytestmark = pytest.mark.realtime

CLOCK = WallClock()


@pytest.fixture
def source() -> TickingCamera:
    return TickingCamera()


@pytest.fixture
def server(source: TickingCamera) -> Iterator[MjpegServer]:
    with MjpegServer(source.read) as serving:
        yield serving


@pytest.fixture
def camera(server: MjpegServer) -> Iterator[OpenCvCamera]:
    opened = open_stream(server)
    yield opened
    opened.close()


def open_stream(server: MjpegServer) -> OpenCvCamera:
    settings = CameraSettings(
        source=server.url, rate_check_s=0.1, first_backoff_s=0.05, max_backoff_s=0.1
    )
    return OpenCvCamera(settings, CLOCK)


def until(condition: Callable[[], bool], limit_s: float = 10.0) -> None:
    """Look again and again; fails after ``limit_s``."""
    deadline_s = CLOCK.now_s() + limit_s
    while not condition():
        assert CLOCK.now_s() < deadline_s, "it never came to that"
        CLOCK.sleep_until(CLOCK.now_s() + 0.005)


def test_frames_arrive_as_they_were_with_their_stamps(
    source: TickingCamera, camera: OpenCvCamera
) -> None:
    for _ in range(5):
        frame = camera.read(2.0)
        assert frame is not None
        assert frame.stamp_source == "stream"
        assert frame.exposure_s == pytest.approx(0.004)
        sent = noisy(source.seq_at(frame.t_exposure_mid_s))
        assert np.abs(frame.image.astype(int) - sent).max() <= 4  # JPEG is not exact
        assert 0.0 <= CLOCK.now_s() - frame.t_exposure_mid_s < 0.5


def test_several_clients_see_the_same_frames(server: MjpegServer, camera: OpenCvCamera) -> None:
    other = open_stream(server)
    try:
        after_s = CLOCK.now_s()
        stamps = [
            {frame.t_exposure_mid_s for _ in range(10) if (frame := each.read_after(after_s, 2.0))}
            for each in (camera, other)
        ]
        assert all(stamps)
        assert other.health().dropped + camera.health().dropped < 20
    finally:
        other.close()


def test_unplugged_is_noticed_and_mended(server: MjpegServer, camera: OpenCvCamera) -> None:
    server.inject("camera_unplug")
    until(lambda: camera.health().state == "reopening")
    with pytest.raises(ConnectError, match="does not answer"):
        open_stream(server)
    server.clear()
    assert camera.read_after(CLOCK.now_s(), 5.0) is not None
    until(lambda: camera.health().problem is None)
    assert camera.health().reopened >= 1


def test_a_frozen_stream_shows_as_stalled_and_is_mended(
    server: MjpegServer, camera: OpenCvCamera
) -> None:
    server.inject("camera_freeze")
    until(lambda: camera.health().state in ("stalled", "reopening"))
    server.clear()
    assert camera.read_after(CLOCK.now_s(), 5.0) is not None


def test_a_picture_sent_again_and_again_is_never_returned_as_new(
    server: MjpegServer, camera: OpenCvCamera
) -> None:
    assert camera.read(2.0) is not None
    server.inject("camera_repeat")
    until(lambda: camera.health().refused > 0)
    start_s = CLOCK.now_s()
    assert camera.read_after(start_s, 0.3) is None
    server.clear()
    assert camera.read_after(CLOCK.now_s(), 5.0) is not None


def test_the_port_stays_while_unplugged_and_a_taken_one_is_an_error(server: MjpegServer) -> None:
    port = int(server.url.rsplit(":", 1)[1].partition("/")[0])
    with pytest.raises(ConnectError, match=str(port)):
        MjpegServer(TickingCamera().read, port=port)
    url = server.url
    server.inject("camera_unplug")
    server.clear()
    assert server.url == url


def test_when_the_source_fails_the_stream_ends_and_the_reason_is_kept() -> None:
    def failing(timeout_s: float) -> Frame | None:
        raise OperateError("the world has ended")

    with MjpegServer(failing) as server:
        until(lambda: server.error is not None)
        with pytest.raises(ConnectError):
            open_stream(server)
    assert "the world has ended" in str(server.error)
