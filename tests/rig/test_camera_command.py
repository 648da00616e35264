"""``rig camera`` as a user meets it."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from drivers.camera import v4l2_nodes
from drivers.camera.v4l2_ioctl import OfferedMode
from drivers.camera.v4l2_nodes import Holder, VideoNode
from drivers.errors import ConfigError, ConnectError, RigError
from rig.commands.camera import camera_app
from rig.commands.camera_preview import half_blocks
from rig.exit_codes import ExitCode
from sim_backend.loopback_camera.server import MjpegServer
from tests.drivers.camera import recordings
from tests.drivers.camera.streams import TickingCamera

MODES = (
    OfferedMode("YUYV", 640, 480, (30.0, 15.0), stepwise=False),
    OfferedMode("MJPG", 1920, 1080, (60.0,), stepwise=False),
)
CAMERA = VideoNode(
    "/dev/video0", "Maker Cam", ("/dev/v4l/by-id/usb-Maker-index0",), True, MODES,
    (Holder(42, "cheese"),), None,
)  # fmt: skip
METADATA = VideoNode("/dev/video1", "Maker Cam", (), False, (), (), None)


def call(*arguments: str) -> Result:
    return CliRunner().invoke(camera_app, arguments, env={"COLUMNS": "200"})


def fails(kind: type[RigError], *arguments: str) -> str:
    """The error's message; ``rig`` itself prints it and picks the exit status."""
    with pytest.raises(kind) as raised:
        CliRunner().invoke(camera_app, arguments, catch_exceptions=False)
    return str(raised.value)


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> list[VideoNode]:
    nodes: list[VideoNode] = []
    monkeypatch.setattr(v4l2_nodes, "list_nodes", lambda: nodes)
    return nodes


def test_without_any_camera_it_says_so_and_what_to_do(machine: list[VideoNode]) -> None:
    result = call("list")
    assert result.exit_code == 0
    assert "no camera is connected" in result.output
    assert json.loads(call("list", "--json").stdout) == {"cameras": []}
    for command in ("show", "check"):
        assert "no camera is connected" in fails(ConnectError, command)


def test_a_camera_is_listed_with_its_stable_name_modes_and_holder(
    machine: list[VideoNode],
) -> None:
    machine += [CAMERA, METADATA]
    output = call("list").stdout
    for words in ("usb-Maker-index0", "YUYV up to 640x480, up to 30 fps", "process 42 (cheese)"):
        assert words in output
    assert "/dev/video1" not in output  # delivers no pictures
    whole = call("list", "--source", "0").stdout
    assert "YUYV 640x480 @ 30, 15" in whole
    listed = json.loads(call("list", "--json").stdout)["cameras"]
    assert [node["node"] for node in listed] == ["/dev/video0", "/dev/video1"]


def test_a_long_stable_name_can_be_copied_from_a_narrow_terminal(machine: list[VideoNode]) -> None:
    name = "/dev/v4l/by-id/usb-046d_Maker_Professional_Webcam_C920_1A2B3C4D-video-index0"
    machine.append(replace(CAMERA, by_id=(name,)))
    assert name in CliRunner().invoke(camera_app, ["list"], env={"COLUMNS": "60"}).stdout


def test_with_several_cameras_one_must_be_chosen(machine: list[VideoNode]) -> None:
    machine += [CAMERA, CAMERA]
    assert "choose with --source" in fails(ConfigError, "check")


@pytest.mark.parametrize(
    ("arguments", "kind", "words"),
    [
        (["show", "--source", "no/such/file"], ConfigError, "does not exist"),
        (["check", "--source", "/dev/video99"], ConnectError, "there is no /dev/video99"),
        (["list", "--source", "/dev/video99"], ConnectError, "there is no /dev/video99"),
        (["check", "--source", ".", "--size", "big"], ConfigError, "write it as 640x480"),
        (["check", "--source", ".", "--fourcc", "X"], ConfigError, "fourcc"),
        (["list", "--source", "http://h/"], ConfigError, "shows devices"),
    ],
)
def test_what_cannot_be_done_is_told_in_words(
    arguments: list[str], kind: type[RigError], words: str
) -> None:
    assert words in fails(kind, *arguments)


def test_show_describes_and_saves_one_picture(tmp_path: Path) -> None:
    source = recordings.make_folder(tmp_path / "images")
    saved = tmp_path / "picture.png"
    result = call("show", "--source", str(source), "--save", str(saved))
    assert result.exit_code == 0, result.output
    assert "64x48" in result.stdout
    written = np.asarray(cv2.imread(str(saved), cv2.IMREAD_GRAYSCALE))
    assert np.array_equal(written, recordings.picture(0))
    unknown = str(tmp_path / "picture.nonsense")
    assert "cannot write" in fails(ConfigError, "show", "--source", str(source), "--save", unknown)


def test_the_terminal_preview_keeps_shape_and_brightness() -> None:
    image = np.zeros((480, 640), np.uint8)
    image[:, 320:] = 200
    text = half_blocks(image, columns=40, rows=50)
    lines = text.plain.splitlines()
    assert [len(line) for line in lines] == [40] * 15  # two pixels high, as wide as told
    styles = [str(span.style) for span in text.spans]
    assert styles[0] == "rgb(0,0,0) on rgb(0,0,0)"
    assert styles[39] == "rgb(200,200,200) on rgb(200,200,200)"


def test_check_of_a_recording_prints_one_json_object(tmp_path: Path) -> None:
    source = recordings.make_video(tmp_path / "v.avi")
    result = call("check", "--source", str(source), "--for", "0.5", "--json")
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert (report["width"], report["height"], report["ok"]) == (64, 48, True)
    assert report["stamp_source"] == "replay"
    assert report["measured_fps"] == pytest.approx(recordings.RATE_HZ, rel=0.01)
    assert report["latency_median_s"] is None  # a recording has none
    assert "64" in call("check", "--source", str(source), "--for", "0.2").stdout


def test_check_of_a_stream_tells_rate_jitter_and_latency() -> None:
    with MjpegServer(TickingCamera().read) as server:
        result = call("check", "--source", server.url, "--for", "0.6", "--json", "--fps", "50")
    report = json.loads(result.stdout)
    assert report["stamp_source"] == "stream"
    assert report["measured_fps"] == pytest.approx(50.0, rel=0.02)
    assert 0.0 <= report["latency_median_s"] < 0.2
    assert report["stamp_jitter_s"] < 0.01
    assert report["frames"] > 5


def test_check_fails_when_the_camera_does_not_do_what_was_asked() -> None:
    with MjpegServer(TickingCamera().read) as server:
        arguments = ["check", "--source", server.url, "--for", "0.2", "--json", "--size", "99x9"]
        result = call(*arguments)
    assert result.exit_code == ExitCode.DEVICE
    report = json.loads(result.stdout)
    assert report["ok"] is False
    assert any("99x9" in warning for warning in report["warnings"])
