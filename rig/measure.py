"""``rig measure``: the feature s of a sphere or cylinder in image files."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from drivers.clock import thread_cpu_time_s
from drivers.errors import ConfigError
from estimator.image.feature import Measurement
from estimator.image.tracker import TargetTracker, warm_up
from rig.intrinsics_option import read_intrinsics

GreyImage = NDArray[np.uint8]


class TargetName(StrEnum):
    """What to look for."""

    sphere = "sphere"
    cylinder = "cylinder"


class MethodName(StrEnum):
    """How to measure it."""

    limb = "limb"
    moments = "moments"


@dataclass(frozen=True, slots=True)
class ImageResult:
    """One image's measurement and its cost."""

    image: str
    measurement: Measurement
    cpu_ms: float
    decoded: bool = True


def measure(
    images: Annotated[
        list[Path], typer.Argument(help="Image files, measured in this order.", show_default=False)
    ],
    target: Annotated[TargetName, typer.Option(help="What to look for.")],
    intrinsics: Annotated[
        str,
        typer.Option(
            metavar="FILE|fx,fy,cx,cy[,k1,k2,p1,p2,k3]",
            help="The camera: numbers in px (pixel centres at integers), or a YAML file with "
            "fx, fy, cx, cy and, if any, distortion: [k1, k2, p1, p2, k3], at the top level or "
            "under intrinsics.",
        ),
    ],
    method: Annotated[
        MethodName,
        typer.Option(help="limb: the outline's pixels; moments: threshold and area, sphere only."),
    ] = MethodName.limb,
    sequence: Annotated[
        bool, typer.Option("--sequence", help="Track from image to image.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object per image and line.")
    ] = False,
) -> None:
    """Measure s = P0 / R of a sphere or cylinder in images.

    With --json each line holds: image, found, reason (null when found), s, axis (cylinder only),
    s_std (standard deviations of s; s, axis and s_std are null when not found) and cpu_ms (of this
    image's measurement on one thread, without reading the file). Colour is converted to grey,
    16-bit images are scaled to 8.

    Exit codes: 0 all images were read, whether or not the target is in them; 2 a wrong option, or a
    file that is missing or no image (nothing is measured then). An image that turns out to be
    damaged is reported as not found, the others are still measured, and the exit code is 2.
    """
    try:
        results = measure_files(images, target, intrinsics, method, sequence)
        damaged = [_printed(result, target, as_json) for result in results]
    except ConfigError as error:
        typer.echo(f"Error: {error}", err=True)
        raise typer.Exit(2) from error
    if any(damaged):
        raise typer.Exit(2)


def measure_files(
    images: list[Path],
    target: TargetName,
    intrinsics: str,
    method: MethodName = MethodName.limb,
    sequence: bool = False,
) -> Iterator[ImageResult]:
    """Results image by image, as they are measured.

    Raises ConfigError before the first result for wrong intrinsics, missing files and files that
    are no images.
    """
    camera = read_intrinsics(intrinsics)
    if target == TargetName.cylinder and method == MethodName.moments:
        raise ConfigError("--method moments measures spheres only: use limb for a cylinder")
    for path in images:
        _check_file(path)
    return _measured(images, TargetTracker(target.value, camera, method.value), sequence)


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


def json_line(result: ImageResult, target: TargetName) -> str:
    """One image's result as one line of strict JSON."""
    feature = result.measurement.feature
    record: dict[str, Any] = {
        "image": result.image,
        "found": feature is not None,
        "reason": None if feature is not None else result.measurement.reason,
        "s": None if feature is None else feature.s.tolist(),
    }
    if target == TargetName.cylinder:
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


def _printed(result: ImageResult, target: TargetName, as_json: bool) -> bool:
    """Print a result; True when its file was damaged."""
    typer.echo(json_line(result, target) if as_json else text_line(result))
    if not result.decoded:
        typer.echo(f"Error: {result.measurement.reason}", err=True)
    return not result.decoded


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
