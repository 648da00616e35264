"""The thread around the grab loop: on the wall clock, with a scripted device, briefly."""

import threading
from collections.abc import Callable, Iterator

import pytest

from drivers.camera.live import OpenCvCamera
from drivers.camera.settings import CameraSettings
from drivers.clock import WallClock
from drivers.errors import ConnectError, OperateError
from tests.drivers.camera.scripted import Script

pytestmark = pytest.mark.realtime

Make = Callable[..., OpenCvCamera]


@pytest.fixture
def script() -> Script:
    return Script(WallClock())


@pytest.fixture
def make(script: Script) -> Iterator[Make]:
    opened: list[OpenCvCamera] = []

    def build(**settings: object) -> OpenCvCamera:
        given = {"rate_check_s": 0.0, "first_backoff_s": 0.02, **settings}
        made = OpenCvCamera(CameraSettings(**given), script.clock, script.open)  # type: ignore[arg-type]
        opened.append(made)
        return made

    yield build
    for camera in opened:
        camera.close()


def test_reading_waits_no_longer_than_told(make: Make, script: Script) -> None:
    camera = make()
    assert camera.read(1.0) is not None
    script.dropped = lambda n: True
    camera.read(0.1)
    start_s = script.clock.now_s()
    assert camera.read(0.2) is None
    assert 0.19 <= script.clock.now_s() - start_s < 1.0


def test_read_after_returns_only_what_was_exposed_after(make: Make, script: Script) -> None:
    camera = make()
    after_s = script.clock.now_s() + 0.1
    frame = camera.read_after(after_s, 2.0)
    assert frame is not None
    assert frame.t_exposure_mid_s > after_s


def test_an_interruption_is_survived_and_told(make: Make, script: Script) -> None:
    camera = make()
    assert camera.read(1.0) is not None
    at_s = script.clock.now_s()
    script.gone = lambda t_s: at_s <= t_s < at_s + 0.2
    after = camera.read_after(at_s + 0.2, 3.0)
    assert after is not None
    assert camera.health().reopened == 1


def test_a_camera_lost_for_good_raises_and_says_why(make: Make, script: Script) -> None:
    camera = make(give_up_after_s=0.2)
    script.gone = lambda t_s: True
    with pytest.raises(OperateError, match="given up after"):
        for _ in range(100):
            camera.read(0.1)
    assert camera.health().state == "failed"


def test_a_reader_that_waits_hears_of_the_failure_at_once(make: Make, script: Script) -> None:
    camera = make(give_up_after_s=0.1)
    script.gone = lambda t_s: True
    start_s = script.clock.now_s()
    with pytest.raises(OperateError):
        while True:
            camera.read(20.0)
    assert script.clock.now_s() - start_s < 5.0


def test_a_fault_of_the_program_reaches_the_reader(
    make: Make, script: Script, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(threading, "excepthook", lambda args: None)
    camera = make()

    def broken(n: int) -> bool:
        raise ZeroDivisionError("a bug")

    script.corrupt = broken
    with pytest.raises(OperateError, match=r"internal error.*a bug"):
        for _ in range(50):
            camera.read(0.1)
    assert script.released == script.opened


def test_closing_releases_ends_the_thread_and_forbids_reading(make: Make, script: Script) -> None:
    camera = make()
    camera.close()
    camera.close()
    assert script.released == script.opened == 1
    assert camera.health().state == "closed"
    with pytest.raises(OperateError, match="after close"):
        camera.read(0.0)


def test_a_camera_that_cannot_be_opened_leaves_nothing_behind(make: Make, script: Script) -> None:
    script.gone = lambda t_s: True
    with pytest.raises(ConnectError, match="no such camera"):
        make()
    assert all(thread.name != "camera" for thread in threading.enumerate())
