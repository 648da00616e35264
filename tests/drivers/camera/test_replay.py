"""Recordings play at their rate on the clock given, without anybody waiting for real."""

from pathlib import Path

import numpy as np
import pytest

from drivers.camera.replay import ReplayCamera
from drivers.camera.settings import CameraSettings
from drivers.errors import ConnectError, OperateError
from sim_backend.clock import SimulatedClock
from tests.drivers.camera.recordings import COUNT, RATE_HZ, make_folder, make_video, number_in


@pytest.fixture(params=["folder", "glob", "video"])
def source(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "video":
        return str(make_video(tmp_path / "v.avi"))
    folder = make_folder(tmp_path / "images")
    return str(folder) if request.param == "folder" else str(folder / "frame*.png")


def camera(source: str, clock: SimulatedClock, **settings: object) -> ReplayCamera:
    return ReplayCamera(CameraSettings(source=source, **settings), clock)  # type: ignore[arg-type]


def test_every_picture_comes_once_in_order_at_its_instant(source: str) -> None:
    clock = SimulatedClock(50.0)
    replay = camera(source, clock, rate_hz=10.0)
    for index in range(COUNT):
        frame = replay.read(1.0)
        assert frame is not None
        assert number_in(frame.image) == frame.seq == index
        assert frame.t_exposure_mid_s == pytest.approx(50.0 + index / 10.0)
        assert clock.now_s() == pytest.approx(frame.t_exposure_mid_s)
        assert frame.stamp_source == "replay"
    with pytest.raises(OperateError, match=f"ended after {COUNT} pictures"):
        replay.read(1.0)


def test_in_a_loop_it_starts_again(source: str) -> None:
    replay = camera(source, SimulatedClock(), loop=True)
    numbers = [number_in(f.image) for _ in range(2 * COUNT + 3) if (f := replay.read(1.0))]
    assert numbers == [i % COUNT for i in range(2 * COUNT + 3)]


def test_pictures_nobody_reads_in_time_are_skipped(source: str) -> None:
    clock = SimulatedClock()
    replay = camera(source, clock, rate_hz=10.0)
    replay.read(0.0)
    clock.sleep_until(0.75)
    frame = replay.read(0.0)
    assert frame is not None
    assert number_in(frame.image) == frame.seq == 7
    assert replay.health().dropped == 6


def test_looking_does_not_wait(source: str) -> None:
    clock = SimulatedClock()
    replay = camera(source, clock)
    assert replay.read(0.0) is not None
    assert replay.read(0.0) is None
    assert clock.now_s() == 0.0
    assert replay.read(0.001) is None
    assert clock.now_s() == pytest.approx(0.001)


def test_read_after_skips_what_was_taken_before(source: str) -> None:
    replay = camera(source, SimulatedClock(), rate_hz=10.0)
    replay.read(0.0)
    frame = replay.read_after(0.45, timeout_s=1.0)
    assert frame is not None
    assert frame.seq == 5
    assert replay.read_after(1.0, timeout_s=0.2) is None


def test_a_video_has_its_own_rate(tmp_path: Path) -> None:
    replay = camera(str(make_video(tmp_path / "v.avi")), SimulatedClock())
    first, second = replay.read(1.0), replay.read(1.0)
    assert first is not None and second is not None
    assert second.t_exposure_mid_s - first.t_exposure_mid_s == pytest.approx(1 / RATE_HZ)


def test_another_size_than_requested_is_an_error_or_a_warning(source: str) -> None:
    with pytest.raises(ConnectError, match="size 640x480 requested, got 64x48"):
        camera(source, SimulatedClock(), width=640, height=480)
    replay = camera(source, SimulatedClock(), width=640, height=480, optional=("size",))
    assert len(replay.health().warnings) == 1


def test_a_told_exposure_is_passed_on(source: str) -> None:
    replay = camera(source, SimulatedClock(), assumed_exposure_s=0.003)
    frame = replay.read(0.0)
    assert frame is not None and frame.exposure_s == 0.003


def test_numbers_in_names_sort_as_numbers(tmp_path: Path) -> None:
    replay = camera(str(make_folder(tmp_path / "i", 12)), SimulatedClock())
    images = [f.image for _ in range(12) if (f := replay.read(1.0))]
    assert [number_in(image) for image in images] == list(range(12))


def test_a_file_that_is_no_video_and_an_empty_folder_are_errors(tmp_path: Path) -> None:
    bad = tmp_path / "x.avi"
    bad.write_bytes(b"nothing")
    with pytest.raises(ConnectError, match="not a readable video"):
        camera(str(bad), SimulatedClock())
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConnectError, match="holds no image"):
        camera(str(tmp_path / "empty"), SimulatedClock())


def test_an_unreadable_picture_on_the_way_is_an_error_that_names_it(tmp_path: Path) -> None:
    folder = make_folder(tmp_path / "i", 3)
    (folder / "frame1.png").write_bytes(b"nothing")
    replay = camera(str(folder), SimulatedClock())
    assert np.any(replay.read(1.0).image)  # type: ignore[union-attr]
    with pytest.raises(OperateError, match=r"frame1\.png"):
        replay.read(1.0)
