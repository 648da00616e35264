"""Listing and explaining devices, on a made-up /dev and /sys."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.camera import v4l2_ioctl, v4l2_nodes
from drivers.camera.device import ControlName
from drivers.camera.opencv_device import OpenCvDevice
from drivers.camera.source import parse_source
from drivers.camera.v4l2_controls import V4l2Controls
from drivers.clock import WallClock
from drivers.errors import ConnectError


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A machine with a ``video0`` that is a plain file and a by-id name for it."""
    for name in ("dev/v4l/by-id", "sys/video0", "sys/video10", "sys/video2", "sys/vbi0"):
        (tmp_path / name).mkdir(parents=True)
    for n in (0, 2, 10):
        (tmp_path / f"sys/video{n}/name").write_text(f"Cam {n}\n")
        (tmp_path / f"dev/video{n}").touch()
    (tmp_path / "dev/v4l/by-id/usb-Maker_Cam-index0").symlink_to(tmp_path / "dev/video0")
    monkeypatch.setattr(v4l2_nodes, "DEV", tmp_path / "dev")
    monkeypatch.setattr(v4l2_nodes, "SYSFS", tmp_path / "sys")
    monkeypatch.setattr(v4l2_nodes, "BY_ID", tmp_path / "dev/v4l/by-id")
    yield tmp_path


def test_nodes_are_listed_in_the_order_of_their_numbers_with_stable_names(machine: Path) -> None:
    nodes = v4l2_nodes.list_nodes()
    assert [Path(node.node).name for node in nodes] == ["video0", "video2", "video10"]
    assert nodes[0].name == "Cam 0"
    assert nodes[0].by_id == (str(machine / "dev/v4l/by-id/usb-Maker_Cam-index0"),)
    assert nodes[1].by_id == ()


def test_a_node_that_cannot_be_asked_is_listed_with_the_reason(machine: Path) -> None:
    node = v4l2_nodes.list_nodes()[0]
    assert node.captures is None
    assert node.problem


def test_a_machine_without_cameras_lists_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(v4l2_nodes, "SYSFS", tmp_path / "nothing")
    assert v4l2_nodes.list_nodes() == []
    assert "no camera is connected" in v4l2_nodes.why_not_opened("/dev/video99")


def test_who_holds_a_node_is_found(machine: Path) -> None:
    node = str(machine / "dev/video0")
    hold = "import sys; held = open(sys.argv[1]); print('held', flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", hold, node], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        found = v4l2_nodes.holders_of(str(machine / "dev/v4l/by-id/usb-Maker_Cam-index0"))
        process.communicate()
    assert [holder.pid for holder in found] == [process.pid]
    assert str(process.pid) in str(found[0])
    assert v4l2_nodes.holders_of(node) == ()


def test_a_missing_device_is_explained_without_opening_it() -> None:
    with pytest.raises(ConnectError, match="there is no /dev/video99"):
        OpenCvDevice(parse_source(99), WallClock(), 1)


def test_a_file_that_is_no_device_is_an_error_in_words(machine: Path) -> None:
    path = str(machine / "dev/video0")
    assert "cannot be opened" in v4l2_nodes.why_not_opened(path)
    controls = V4l2Controls(path)
    names: list[ControlName] = ["exposure", "gain"]
    assert [controls.read(name) for name in names] == [None, None]
    assert controls.write("gain", 3) == "this camera does not have it"
    controls.close()
    controls.close()
    with pytest.raises(ConnectError):
        V4l2Controls(str(machine / "dev/video77"))


def test_what_is_no_video_node_answers_no_question() -> None:
    fd = os.open(os.devnull, os.O_RDWR)
    try:
        with pytest.raises(OSError):
            v4l2_ioctl.query_node(fd)
        assert list(v4l2_ioctl.offered_modes(fd, multiplanar=False)) == []
    finally:
        os.close(fd)
