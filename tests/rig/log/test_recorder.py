"""The log's thread: nothing is lost, nobody is held up, a full disk ends the log and no more."""

import io
from pathlib import Path

import pytest
from mcap.reader import make_reader

from rig.log import recorder as module
from rig.log.mcap_file import McapFile
from rig.log.reader import open_log
from rig.log.recorder import Recorder
from tests.rig.log.disks import (
    PATIENCE_S,
    FullDisk,
    StuckDisk,
    encoder,
    picture,
    recorder,
    tick,
)


def topics_of(data: bytes) -> list[str]:
    """The topics of a file's messages in order, as the official reader has them."""
    return [channel.topic for _, channel, _ in make_reader(io.BytesIO(data)).iter_messages()]


def test_everything_handed_over_is_in_the_file_in_order(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    log = recorder(path.open("wb"), path, [])
    for number in range(3000):
        log.put(tick(number), 0.001 * number)
    result = log.close()
    assert result.error == ""
    assert result.size_bytes == path.stat().st_size
    records = list(open_log(path).records(["tick"]))
    assert [record.values()["overruns"] for record in records] == list(range(3000))
    assert [record.logged_ns for record in records] == [1_000_000 * k for k in range(3000)]


def test_a_slow_disk_costs_images_first_and_they_are_counted(tmp_path: Path) -> None:
    disk = StuckDisk()
    log = recorder(disk, tmp_path / "log.mcap", [])
    disk.stuck = True
    log.put(picture(0), 0.0)
    assert disk.reached.wait(PATIENCE_S)
    for number in range(1, 100):  # would wait for ever if it waited
        log.put(picture(number), 0.001 * number)
        log.put(tick(number), 0.001 * number)
    disk.free.set()
    result = log.close()
    assert result.images_dropped > 0
    assert result.images + result.images_dropped == 100
    assert result.images >= 40  # memory for that many is there
    assert result.entries_dropped == 0
    topics = topics_of(disk.kept)
    assert topics.count("/control/tick") == 99
    assert topics.count("/camera/image_raw") == result.images


def test_memory_is_bounded_when_a_disk_takes_nothing_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_MOST_ENTRIES", 50)
    disk = StuckDisk()
    log = recorder(disk, tmp_path / "log.mcap", [])
    disk.stuck = True
    log.put(tick(0), 0.0)
    assert disk.reached.wait(PATIENCE_S)
    for number in range(1, 201):
        log.put(tick(number), 0.001 * number)
    disk.free.set()
    assert log.close().entries_dropped == 150


def test_the_end_of_a_run_does_not_wait_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_CLOSE_TIMEOUT_S", 0.01)
    warnings: list[str] = []
    disk = StuckDisk()
    log = recorder(disk, tmp_path / "log.mcap", warnings)
    disk.stuck = True
    log.put(tick(0), 0.0)
    assert disk.reached.wait(PATIENCE_S)
    result = log.close()
    assert "was not written within" in result.error
    assert len(warnings) == 1
    disk.free.set()


def test_on_simulated_time_the_loop_waits_and_nothing_is_dropped(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    log = recorder(path.open("wb"), path, [], realtime=False)
    for number in range(100):
        log.put(picture(number), 0.01 * number)
    result = log.close()
    assert (result.images, result.images_dropped) == (100, 0)


def test_a_full_disk_ends_the_recording_with_one_warning_and_what_was_flushed_stays(
    tmp_path: Path,
) -> None:
    path, warnings = tmp_path / "log.mcap", list[str]()
    file = io.BufferedWriter(FullDisk(path, 30_000))
    log = Recorder(McapFile(path, file), encoder(), None, warnings.append)
    for number in range(30_000):
        log.put(tick(number), 0.001 * number)
    result = log.close()
    assert "No space left" in result.error
    assert len(warnings) == 1 and "the run goes on" in warnings[0]
    assert 0 < result.size_bytes == path.stat().st_size <= 30_000
    kept = [record.values()["overruns"] for record in open_log(path).records(["tick"])]
    assert len(kept) > 500
    assert kept == list(range(len(kept)))


def test_a_log_that_nothing_was_written_to_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    log = recorder(path.open("wb"), path, [])
    assert log.close().error == ""
    assert log.close().error == ""
    assert topics_of(path.read_bytes()) == []
    assert open_log(path).finished
