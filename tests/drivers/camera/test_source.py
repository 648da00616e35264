"""What a source string means."""

from pathlib import Path

import pytest

from drivers.camera.source import SourceKind, parse_source
from drivers.errors import ConfigError


@pytest.mark.parametrize(
    ("source", "kind", "address"),
    [
        (0, SourceKind.DEVICE, "/dev/video0"),
        ("2", SourceKind.DEVICE, "/dev/video2"),
        ("/dev/video3", SourceKind.DEVICE, "/dev/video3"),
        ("/dev/v4l/by-id/usb-x-index0", SourceKind.DEVICE, "/dev/v4l/by-id/usb-x-index0"),
        ("http://h:1/s.mjpg", SourceKind.MJPEG, "http://h:1/s.mjpg"),
        ("HTTPS://h/s", SourceKind.MJPEG, "HTTPS://h/s"),
        ("rtsp://h/s", SourceKind.STREAM, "rtsp://h/s"),
    ],
)
def test_devices_and_streams_are_told_by_their_form(
    source: int | str, kind: SourceKind, address: str
) -> None:
    parsed = parse_source(source)
    assert (parsed.kind, parsed.address) == (kind, address)


def test_recordings_are_told_by_what_is_on_the_disk(tmp_path: Path) -> None:
    (tmp_path / "a.png").touch()
    assert parse_source(str(tmp_path)).kind is SourceKind.IMAGES
    assert parse_source(str(tmp_path / "*.png")).kind is SourceKind.IMAGES
    assert parse_source(str(tmp_path / "a.png")).kind is SourceKind.FILE


@pytest.mark.parametrize("source", ["nothing/here", "gopher://h/s", "nothing/*.png", ""])
def test_anything_else_is_an_error_that_names_it(source: str) -> None:
    with pytest.raises(ConfigError, match="camera source") as raised:
        parse_source(source)
    assert repr(source) in str(raised.value)
