"""Recorded pictures in their order: a video file, or the images of a folder."""

import re
from glob import glob
from pathlib import Path
from typing import Protocol

import numpy as np

from drivers.camera.source import Source, SourceKind
from drivers.errors import ConnectError, OperateError
from drivers.interfaces import GreyImage

_SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".ppm", ".tif", ".tiff", ".webp"}


class Recording(Protocol):
    """Pictures by their number; numbers only rise, except back to 0."""

    count: int
    rate_hz: float | None  # None: the recording does not tell

    def image(self, index: int) -> GreyImage:
        """Picture ``index``; raises OperateError when it cannot be read."""
        ...

    def close(self) -> None:
        """Let go of the files."""
        ...


def open_recording(source: Source) -> Recording:
    """Open a file or folder; raises ConnectError when there is nothing to show in it."""
    if source.kind is SourceKind.FILE:
        return VideoFile(source.address)
    return ImageFolder(source.address)


class ImageFolder:
    """The images of a folder or of a glob, numbers in their names in numerical order."""

    def __init__(self, address: str) -> None:
        folder = Path(address)
        paths = list(folder.iterdir()) if folder.is_dir() else [Path(p) for p in glob(address)]
        images = [path for path in paths if path.suffix.lower() in _SUFFIXES]
        if not images:
            raise ConnectError(f"{address} holds no image ({', '.join(sorted(_SUFFIXES))})")
        self._paths = sorted(images, key=_natural)
        self.count = len(self._paths)
        self.rate_hz: float | None = None

    def image(self, index: int) -> GreyImage:
        """Read one image file."""
        import cv2

        path = self._paths[index]
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        if image is None:
            raise OperateError(f"{path} is not a readable image: remove it or mend it")
        return np.asarray(image, dtype=np.uint8)

    def close(self) -> None:
        """Nothing is held open."""


class VideoFile:
    """A video file; pictures are decoded in order, skipped ones too."""

    def __init__(self, address: str) -> None:
        import cv2

        self._cv2 = cv2
        self._address = address
        self._capture = cv2.VideoCapture(address, cv2.CAP_FFMPEG)
        self.count = int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        self.rate_hz: float | None = rate_hz if rate_hz > 0 else None
        self._next = 0
        if not self._capture.isOpened() or self.count < 1:
            self.close()
            raise ConnectError(f"{address} is not a readable video")

    def image(self, index: int) -> GreyImage:
        """Decode forward to ``index``; back to the start when it lies behind."""
        cv2, capture = self._cv2, self._capture
        if index < self._next:
            capture.release()
            capture.open(self._address, cv2.CAP_FFMPEG)
            self._next = 0
        while self._next <= index:
            if not capture.grab():
                raise OperateError(f"{self._address} ends at picture {self._next} of {self.count}")
            self._next += 1
        decoded, picture = capture.retrieve()
        if not decoded:
            raise OperateError(f"{self._address}: picture {index} is damaged")
        if picture.ndim == 2:
            return np.asarray(picture, dtype=np.uint8)
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dtype=np.uint8)

    def close(self) -> None:
        """Close the file."""
        self._capture.release()


def _natural(path: Path) -> list[tuple[int, int | str]]:
    """``frame10`` after ``frame9``."""
    pieces = re.split(r"(\d+)", str(path))
    return [(0, int(p)) if p.isdecimal() else (1, p) for p in pieces]
