"""One contract for every camera: simulated, recorded, streamed, scripted and, if there, real."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from glob import glob
from pathlib import Path

import numpy as np
import pytest

from drivers.camera.live import OpenCvCamera
from drivers.camera.open import open_camera
from drivers.camera.settings import CameraSettings
from drivers.clock import Clock, WallClock
from drivers.errors import OperateError
from drivers.interfaces import Camera
from sim_backend.clock import SimulatedClock
from sim_backend.config import CameraConfig, SimConfig
from sim_backend.loopback_camera.server import MjpegServer
from sim_backend.rig import SimulatedRig
from tests.drivers.camera import recordings, scripted, streams

pytestmark = pytest.mark.realtime


@dataclass(frozen=True)
class Backend:
    camera: Camera
    clock: Clock
    period_s: float
    max_age_s: float  # no frame may be older when it is returned


def simulated(stack: ExitStack, folder: Path) -> Backend:
    clock = SimulatedClock(5.0)
    config = SimConfig(renderer="raster", camera=CameraConfig(width=64, height=48, focal_px=80.0))
    rig = SimulatedRig(config, "sphere", clock)
    stack.callback(rig.camera.close)
    return Backend(rig.camera, clock, 1 / 30, 0.15)


def replayed(source: str) -> Backend:
    clock = SimulatedClock(5.0)
    settings = CameraSettings(source=source, rate_hz=20.0, loop=True)
    return Backend(open_camera(settings, clock), clock, 1 / 20, 0.1)


def image_folder(stack: ExitStack, folder: Path) -> Backend:
    return replayed(str(recordings.make_folder(folder / "images")))


def video_file(stack: ExitStack, folder: Path) -> Backend:
    return replayed(str(recordings.make_video(folder / "video.avi")))


def mjpeg_stream(stack: ExitStack, folder: Path) -> Backend:
    ticking = streams.TickingCamera()
    server = stack.enter_context(MjpegServer(ticking.read))
    settings = CameraSettings(source=server.url, rate_check_s=0.2, max_identical=None)
    return Backend(open_camera(settings, ticking.clock), ticking.clock, streams.PERIOD_S, 0.5)


def scripted_device(stack: ExitStack, folder: Path) -> Backend:
    script = scripted.Script(WallClock())
    settings = CameraSettings(rate_check_s=0.2)
    camera = OpenCvCamera(settings, script.clock, script.open)
    return Backend(camera, script.clock, scripted.PERIOD_S, 0.5)


def first_device(stack: ExitStack, folder: Path) -> Backend:
    return live(sorted(glob("/dev/video*"))[0])


def live(source: str) -> Backend:
    clock = WallClock()
    given = int(source) if source.isdecimal() else source
    camera = open_camera(CameraSettings(source=given), clock)
    rate_hz = camera.health().measured_rate_hz
    assert rate_hz is not None
    return Backend(camera, clock, 1 / rate_hz, 0.5)


NEEDS_DEVICE = [
    pytest.mark.slow,
    pytest.mark.skipif(not glob("/dev/video*"), reason="no /dev/video* on this machine"),
]


@pytest.fixture(
    params=[
        simulated,
        image_folder,
        video_file,
        mjpeg_stream,
        scripted_device,
        pytest.param(first_device, marks=NEEDS_DEVICE),
        pytest.param(None, marks=pytest.mark.hardware("--camera-source")),
    ],
    ids=lambda make: "real_camera" if make is None else make.__name__,
)
def backend(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Backend]:
    make: Callable[[ExitStack, Path], Backend] | None = request.param
    with ExitStack() as stack:
        if make is None:
            made = live(request.config.getoption("--camera-source"))
        else:
            made = make(stack, tmp_path)
        stack.callback(made.camera.close)
        yield made


def test_images_are_grey_of_one_size_and_frames_only_go_forward(backend: Backend) -> None:
    frames = [backend.camera.read(2.0) for _ in range(8)]
    found = [frame for frame in frames if frame is not None]
    assert len(found) == 8
    assert len({frame.image.shape for frame in found}) == 1
    for frame in found:
        assert frame.image.dtype == np.uint8
        assert frame.image.ndim == 2
        assert frame.exposure_s >= 0.0
        assert frame.stamp_source
    assert np.all(np.diff([frame.seq for frame in found]) >= 1)
    assert np.all(np.diff([frame.t_exposure_mid_s for frame in found]) > 0)


def test_a_frame_is_never_returned_twice(backend: Backend) -> None:
    first = backend.camera.read(2.0)
    again = backend.camera.read(0.0)
    assert first is not None
    assert again is None or again.seq > first.seq


def test_frames_are_young_even_after_nobody_read_for_a_while(backend: Backend) -> None:
    backend.camera.read(2.0)
    backend.clock.sleep_until(backend.clock.now_s() + 12 * backend.period_s)
    for _ in range(3):
        frame = backend.camera.read(2.0)
        assert frame is not None
        age_s = backend.clock.now_s() - frame.t_exposure_mid_s
        assert -backend.period_s <= age_s < backend.max_age_s


def test_looking_takes_no_time_and_waiting_ends_in_time(backend: Backend) -> None:
    backend.camera.read(2.0)
    start_s = backend.clock.now_s()
    for _ in range(3):
        backend.camera.read(0.0)
    assert backend.clock.now_s() - start_s < 0.2
    start_s = backend.clock.now_s()
    backend.camera.read(0.1)
    assert backend.clock.now_s() - start_s < 0.6


def test_numbers_keep_step_with_time(backend: Backend) -> None:
    first = backend.camera.read(2.0)
    backend.clock.sleep_until(backend.clock.now_s() + 10 * backend.period_s)
    last = backend.camera.read(2.0)
    assert first is not None and last is not None
    steps = (last.t_exposure_mid_s - first.t_exposure_mid_s) / backend.period_s
    assert last.seq - first.seq == pytest.approx(steps, abs=1.5)


def test_after_closing_reading_is_an_error_and_closing_again_harmless(backend: Backend) -> None:
    backend.camera.close()
    backend.camera.close()
    with pytest.raises(OperateError, match="read after close"):
        backend.camera.read(0.0)
