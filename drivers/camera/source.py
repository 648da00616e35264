"""What a camera's source means: a device, a stream or a recording."""

from dataclasses import dataclass
from enum import Enum
from glob import glob, has_magic
from pathlib import Path

from drivers.errors import ConfigError

_STREAM_SCHEMES = ("rtsp", "rtsps", "rtmp", "udp", "tcp", "srt")


class SourceKind(Enum):
    """Which mechanism delivers the images."""

    DEVICE = "device"  # a V4L2 node
    MJPEG = "mjpeg"  # multipart JPEG over HTTP
    STREAM = "stream"  # anything else on the network, through FFmpeg
    FILE = "file"  # a video file
    IMAGES = "images"  # a folder of images or a glob


@dataclass(frozen=True, slots=True)
class Source:
    """Where images come from."""

    kind: SourceKind
    address: str  # path or URL as given; an index has become /dev/videoN


def parse_source(source: int | str) -> Source:
    """Decide what ``source`` is; raises ConfigError for what is none of the known kinds.

    A device need not exist: that is found when it is opened, and again at each attempt.
    """
    text = str(source).strip()
    if text.isdecimal():
        return Source(SourceKind.DEVICE, f"/dev/video{int(text)}")
    scheme, colon, _ = text.partition("://")
    if colon:
        return Source(_stream_kind(scheme.lower(), text), text)
    if text.startswith("/dev/"):
        return Source(SourceKind.DEVICE, text)
    if has_magic(text) and not Path(text).exists():
        if not glob(text):
            raise ConfigError(f"camera source {text!r}: no file matches this pattern")
        return Source(SourceKind.IMAGES, text)
    path = Path(text)
    if text and path.is_dir():
        return Source(SourceKind.IMAGES, text)
    if path.is_file():
        return Source(SourceKind.FILE, text)
    raise ConfigError(
        f"camera source {text!r} does not exist; give an index, /dev/videoN, "
        "/dev/v4l/by-id/..., an http:// or rtsp:// URL, a video file, an image folder or a glob"
    )


def _stream_kind(scheme: str, text: str) -> SourceKind:
    if scheme in ("http", "https"):
        return SourceKind.MJPEG
    if scheme in _STREAM_SCHEMES:
        return SourceKind.STREAM
    raise ConfigError(
        f"camera source {text!r}: unknown scheme {scheme!r}; "
        f"known: http, https, {', '.join(_STREAM_SCHEMES)}"
    )
