"""The features of a sphere or cylinder in image files: read, measured, described."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.clock import thread_cpu_time_s
from drivers.errors import ConfigError
from estimator.image.feature import Measurement
from estimator.image.tracker import Method, Target, TargetTracker, warm_up
from rig.intrinsics_option import read_intrinsics

GreyImage = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class ImageResult:
    """One image's measurement and its cost."""

    image: str
    measurement: Measurement
    cpu_ms: float
    decoded: bool = True


def measure_files(
    images: list[Path],
    target: Target,
    intrinsics: str,
    method: Method = "limb",
    sequence: bool = False,
) -> Iterator[ImageResult]:
    """Results image by image, as they are measured.

    Raises ConfigError before the first result for wrong intrinsics, missing files and files that
    are no images.
    """
    camera = read_intrinsics(intrinsics)
    if target == "cylinder" and method == "moments":
        raise ConfigError("--method moments measures spheres only: use limb for a cylinder")
    for path in images:
        _check_file(path)
    return _measured(images, TargetTracker(target, camera, method), sequence)


def _measured(images: list[Path], tracker: TargetTracker, sequence: bool) -> Iterator[ImageResult]:
    # The times reported are this thread's: nothing may be computed on others.
    cv2.setNumThreads(1)
    warm_up(tracker.target, tracker.intrinsics, tracker.method)
    for path in images:
        image = read_grey(path)
        if image is None:
            reason = f"{path} is damaged: it cannot be decoded as an image"
            yield ImageResult(str(path), Measurement(None, reason), 0.0, decoded=False)
            continue
        if not sequence:
            tracker.reset()
        start_s = thread_cpu_time_s()
        measurement = tracker.measure(image)
        yield ImageResult(str(path), measurement, 1e3 * (thread_cpu_time_s() - start_s))


def read_grey(path: Path) -> GreyImage | None:
    """The file as an 8-bit grey image (height, width); None when it cannot be decoded."""
    try:
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH)
    except cv2.error:
        return None
    if image is None or image.ndim != 2:
        return None
    if image.dtype == np.uint8:
        return _bytes(image)
    if image.dtype == np.uint16:
        return _bytes(np.rint(image / 257.0))
    # Floating-point formats hold 0 to 1.
    return _bytes(np.rint(255.0 * np.clip(np.nan_to_num(image.astype(float)), 0.0, 1.0)))


def _bytes(image: NDArray[Any]) -> GreyImage:
    return image.astype(np.uint8, copy=False)


def json_line(result: ImageResult, target: Target) -> str:
    """One image's result as one line of strict JSON."""
    feature = result.measurement.feature
    record: dict[str, Any] = {
        "image": result.image,
        "found": feature is not None,
        "reason": None if feature is not None else result.measurement.reason,
        "s": None if feature is None else feature.s.tolist(),
    }
    if target == "cylinder":
        axis = None if feature is None else feature.axis
        record["axis"] = None if axis is None else axis.tolist()
    record["s_std"] = None if feature is None else np.sqrt(np.diag(feature.covariance)).tolist()
    record["cpu_ms"] = round(result.cpu_ms, 4)
    return json.dumps(record, allow_nan=False)


def text_line(result: ImageResult) -> str:
    """One image's result for a reader."""
    feature = result.measurement.feature
    if feature is None:
        return f"{result.image}: not found: {result.measurement.reason}"
    std = np.sqrt(np.diag(feature.covariance))
    values = ", ".join(f"{v:.5f} ± {d:.5f}" for v, d in zip(feature.s, std, strict=True))
    axis = ""
    if feature.axis is not None:
        axis = "  axis = (" + ", ".join(f"{v:.5f}" for v in feature.axis) + ")"
    return f"{result.image}: s = ({values}){axis}  [{result.cpu_ms:.1f} ms]"


def _check_file(path: Path) -> None:
    if not path.exists():
        raise ConfigError(f"image {path} does not exist")
    if not path.is_file():
        raise ConfigError(f"image {path} is not a file")
    try:
        readable = cv2.haveImageReader(str(path))
    except cv2.error:
        readable = False
    if not readable:
        raise ConfigError(f"{path} cannot be read as an image: give PNG, JPEG, TIFF, BMP or PGM")
