"""Intrinsics from a folder of pictures of the board: no arm, no camera, nothing opened."""

from collections import Counter
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np

from drivers.errors import ConfigError
from drivers.interfaces import GreyImage
from rig.calibration.detection import BoardDetector
from rig.calibration.errors import CalibrationError
from rig.calibration.intrinsics import IntrinsicsFit, fit_intrinsics
from rig.calibration.views import BoardView

_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
_NAMED = 3  # files named in a message


class Watcher(Protocol):
    """Who is told about every picture."""

    def step(self, name: str, detail: str, total: float | None = None) -> None: ...

    def done(self, count: float) -> None: ...

    def note(self, text: str) -> None: ...


class Interruptible(Protocol):
    """Lets Ctrl-C through at once: nothing moves here."""

    def at_once(self) -> AbstractContextManager[None]: ...


@dataclass(frozen=True, slots=True)
class FolderFit:
    """Intrinsics, and which of the pictures they are from."""

    lens: IntrinsicsFit
    size: tuple[int, int]  # width, height
    pictures: int
    without_board: int


def fit_folder(
    folder: Path,
    detector: BoardDetector,
    expected: tuple[int, int] | None,
    progress: Watcher,
    stop: Interruptible,
) -> FolderFit:
    """Intrinsics from all pictures in ``folder``; ``expected`` is the camera's size, if known.

    Raises ConfigError for a folder without pictures or with pictures of different sizes,
    CalibrationError when they do not determine the intrinsics; it says what is missing.
    """
    with stop.at_once():
        images = _read(folder)
        size = _common_size(images, folder)
        if expected is not None and size != expected:
            raise ConfigError(
                f"the pictures in {folder} have {size[0]}x{size[1]} px, the rig's camera is set "
                f"to {expected[0]}x{expected[1]}: intrinsics hold for one size; take pictures in "
                "the mode that the rig uses"
            )
        views, reasons = _views(images, detector, progress)
        if len(reasons) > 0.5 * len(images):
            most, times = Counter(reasons).most_common(1)[0]
            text = (
                f"the board is seen in {len(views)} of {len(images)} pictures; {times} times: "
                f"{most}"
            )
            if not views:
                raise CalibrationError(
                    f"{text}. Is it the board that the definition says "
                    "(calibration.board), whole and in focus?"
                )
            progress.note(text)
        progress.step("fit", f"intrinsics from {len(views)} pictures")
        return FolderFit(fit_intrinsics(views, size), size, len(images), len(reasons))


def _read(folder: Path) -> dict[str, GreyImage]:
    if not folder.is_dir():
        raise ConfigError(f"--from-images {folder}: there is no such folder")
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES)
    except OSError as error:
        raise ConfigError(f"--from-images {folder}: {error}") from error
    if not paths:
        raise ConfigError(
            f"--from-images {folder}: no pictures there ({', '.join(_SUFFIXES)} are read)"
        )
    images = {}
    for path in paths:
        # As the sensor sees it: a picture turned by its own label has other axes.
        flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
        image = cv2.imread(str(path), flags)
        if image is None:
            raise ConfigError(f"{path} cannot be read as a picture: take it out of the folder")
        images[path.name] = np.asarray(image, dtype=np.uint8)
    return images


def _common_size(images: dict[str, GreyImage], folder: Path) -> tuple[int, int]:
    sizes = Counter((image.shape[1], image.shape[0]) for image in images.values())
    (size, count), *others = sizes.most_common()
    if others:
        odd = [n for n, image in images.items() if (image.shape[1], image.shape[0]) != size]
        named = ", ".join(odd[:_NAMED]) + (" …" if len(odd) > _NAMED else "")
        raise ConfigError(
            f"the pictures in {folder} have different sizes: {count} have {size[0]}x{size[1]} px, "
            f"{len(odd)} another ({named}). Intrinsics hold for one size: take the others out"
        )
    return size


def _views(
    images: dict[str, GreyImage], detector: BoardDetector, progress: Watcher
) -> tuple[list[BoardView], list[str]]:
    views, reasons = [], []
    progress.step("pictures", f"the board in {len(images)} pictures", len(images))
    for number, (name, image) in enumerate(images.items(), start=1):
        found = detector.find(image)
        if found.view is None:
            reasons.append(found.reason)
            progress.note(f"  {name}: left out, {found.reason}")
        else:
            views.append(found.view)
            progress.note(f"  {name}: {len(found.view)} corners")
        progress.done(number)
    return views, reasons
