"""The kernel's virtual camera (vivid), which fails on demand: the true driver end to end.

Skipped where no such device is; ``modprobe vivid`` makes one.
"""

import os
import threading
from collections.abc import Callable, Iterator
from glob import glob
from importlib.util import find_spec
from typing import Literal

import pytest

from drivers.camera import v4l2_ioctl
from drivers.camera.live import OpenCvCamera
from drivers.camera.settings import CameraControls, CameraSettings
from drivers.clock import WallClock
from drivers.errors import ConnectError

# vivid's own controls
TRUE_STAMPS = 0x00F0F018  # 1: stamps as they are, not idealised ones that lie in the future
DROPPED_PERCENT = 0x00F0F040
DISCONNECT = 0x00F0F041
MARK_NEXT_BUFFER_BAD = 0x00F0F042
FATAL_ERROR = 0x00F0F046

RATE_HZ = 25.0
SELECT_TIMEOUT_S = 1
CLOCK = WallClock()
Access = Literal["opencv", "linuxpy"]


def virtual_device() -> str | None:
    for node in sorted(glob("/dev/video*")):
        fd = v4l2_ioctl.open_node(node)
        try:
            info = v4l2_ioctl.query_node(fd)
        finally:
            os.close(fd)
        if info.driver == "vivid" and info.captures:
            return node
    return None


NODE = virtual_device()
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(NODE is None, reason="no virtual camera (vivid) on this machine"),
]


def tell(control: int, value: int) -> None:
    fd = v4l2_ioctl.open_node(str(NODE))
    try:
        v4l2_ioctl.set_control(fd, control, value)
    finally:
        os.close(fd)


def open_virtual(access: Access, **settings: object) -> OpenCvCamera:
    given = {"width": 640, "height": 360, "rate_hz": RATE_HZ, "fourcc": "GREY", **settings}
    made = CameraSettings(source=str(NODE), access=access, **given)  # type: ignore[arg-type]
    return OpenCvCamera(made, CLOCK)


@pytest.fixture(
    params=[
        "opencv",
        pytest.param(
            "linuxpy",
            marks=pytest.mark.skipif(find_spec("linuxpy") is None, reason="linuxpy not installed"),
        ),
    ]
)
def access(request: pytest.FixtureRequest) -> Access:
    chosen: Access = request.param
    return chosen


@pytest.fixture
def camera(access: Access) -> Iterator[OpenCvCamera]:
    tell(TRUE_STAMPS, 1)
    tell(DROPPED_PERCENT, 0)
    opened = open_virtual(access)
    yield opened
    opened.close()


def until(condition: Callable[[], bool], limit_s: float) -> float:
    """How long it took."""
    start_s = CLOCK.now_s()
    while not condition():
        assert CLOCK.now_s() - start_s < limit_s, "it never came to that"
        CLOCK.sleep_until(CLOCK.now_s() + 0.002)
    return CLOCK.now_s() - start_s


def test_rate_and_stamps_are_the_kernels(camera: OpenCvCamera) -> None:
    assert camera.health().measured_rate_hz == pytest.approx(RATE_HZ, rel=0.05)
    for _ in range(10):
        frame = camera.read(1.0)
        assert frame is not None
        assert frame.stamp_source == "kernel"
        assert frame.image.shape == (360, 640)
        assert 0.0 <= CLOCK.now_s() - frame.t_exposure_mid_s < 0.2


def test_a_frame_after_an_instant_was_taken_after_it(camera: OpenCvCamera) -> None:
    CLOCK.sleep_until(CLOCK.now_s() + 1.0)
    asked_s = CLOCK.now_s()
    frame = camera.read_after(asked_s, 1.0)
    assert frame is not None
    assert frame.t_exposure_mid_s > asked_s


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"fourcc": "MJPG"}, "fourcc MJPG requested, got"),
        ({"width": 123, "height": 77}, "size 123x77 requested, got"),
        ({"rate_hz": 27.5}, "rate 27.5 fps requested, got"),
        ({"controls": CameraControls(exposure_ms=4)}, "there is no such control"),
    ],
)
def test_what_it_does_not_do_is_an_error(
    access: Access, settings: dict[str, object], words: str
) -> None:
    with pytest.raises(ConnectError, match=words):
        open_virtual(access, **settings)


def test_gain_holds_because_its_automatic_is_switched_off(access: Access) -> None:
    for gain in (37, 61):
        camera = open_virtual(access, controls=CameraControls(gain=gain), rate_check_s=0.0)
        assert camera.health().warnings == ()
        camera.close()


def test_a_second_user_is_told_who_holds_it(camera: OpenCvCamera, access: Access) -> None:
    with pytest.raises(ConnectError, match="in use"):
        open_virtual(access)
    assert camera.read_after(CLOCK.now_s(), 1.0) is not None


def test_dropped_exposures_are_gaps(camera: OpenCvCamera) -> None:
    tell(DROPPED_PERCENT, 30)
    CLOCK.sleep_until(CLOCK.now_s() + 2.0)
    tell(DROPPED_PERCENT, 0)
    assert 4 <= camera.health().dropped <= 30


def test_a_stall_is_noticed_in_time_and_mended(camera: OpenCvCamera) -> None:
    tell(DROPPED_PERCENT, 100)
    noticed_s = until(lambda: camera.health().state == "reopening", 5.0)
    assert noticed_s <= 2 / RATE_HZ + SELECT_TIMEOUT_S + 0.2
    assert "stalled" in str(camera.health().problem)
    tell(DROPPED_PERCENT, 0)
    until(lambda: camera.health().problem is None, 15.0)
    assert camera.read_after(CLOCK.now_s(), 1.0) is not None


@pytest.mark.parametrize("fault", [DISCONNECT, FATAL_ERROR])
def test_unplugged_or_dead_is_noticed_in_time_and_mended(camera: OpenCvCamera, fault: int) -> None:
    tell(fault, 1)
    noticed_s = until(lambda: camera.health().problem is not None, 5.0)
    assert noticed_s <= 2 / RATE_HZ + 0.2
    until(lambda: camera.health().problem is None, 15.0)
    assert camera.health().reopened >= 1
    assert camera.read_after(CLOCK.now_s(), 1.0) is not None


def test_a_buffer_marked_bad_is_left_out_where_the_mark_is_seen(
    camera: OpenCvCamera, access: Access
) -> None:
    tell(MARK_NEXT_BUFFER_BAD, 1)
    CLOCK.sleep_until(CLOCK.now_s() + 0.5)
    # OpenCV passes it on as an image and hides the mark.
    assert camera.health().corrupt == (1 if access == "linuxpy" else 0)


def test_closing_ends_the_thread(camera: OpenCvCamera) -> None:
    camera.close()
    assert all(thread.name != "camera" for thread in threading.enumerate())
