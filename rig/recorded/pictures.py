"""The few images of a run that its report shows, as PNG files in the run directory."""

import json
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from drivers.errors import ConfigError
from drivers.interfaces import GreyImage
from estimator.image.feature import Feature
from rig.recorded.record import Picture
from rig.run_data import RunData

_FOLDER = "images"
_INDEX = "index.json"
# Noise does not compress: higher levels take longer and gain next to nothing.
_PNG_LEVEL = 1


def write_pictures(run_dir: Path, data: RunData) -> None:
    """Write the snapshots that the run kept, with what was measured in each."""
    snapshots = list(data.snapshots)
    newest = data.newest_snapshot
    if newest is not None and all(kept is not newest for kept in snapshots):
        snapshots.append(newest)
    if not snapshots:
        return
    folder = run_dir / _FOLDER
    folder.mkdir(exist_ok=True)
    entries = []
    for number, snapshot in enumerate(snapshots):
        name, feature = f"{number}.png", snapshot.feature
        ok, png = cv2.imencode(".png", snapshot.image, [cv2.IMWRITE_PNG_COMPRESSION, _PNG_LEVEL])
        assert ok  # a grey image always encodes
        (folder / name).write_bytes(png.tobytes())
        entries.append(
            {
                "file": name,
                "t_s": snapshot.t_s,
                "s": feature.s.tolist(),
                "covariance": feature.covariance.tolist(),
                "axis": None if feature.axis is None else feature.axis.tolist(),
            }
        )
    (folder / _INDEX).write_text(json.dumps(entries, indent=1) + "\n", encoding="utf-8")


def read_pictures(run_dir: Path) -> tuple[Picture, ...]:
    """The images written, none of a run that was cut off; raises ConfigError for a bad index."""
    path = run_dir / _FOLDER / _INDEX
    if not path.exists():
        return ()
    try:
        return tuple(
            Picture(
                t_s=float(entry["t_s"]),
                feature=Feature(
                    np.array(entry["s"], dtype=float),
                    np.array(entry["covariance"], dtype=float),
                    None if entry["axis"] is None else np.array(entry["axis"], dtype=float),
                ),
                load=partial(_load, path.parent / entry["file"]),
            )
            for entry in json.loads(path.read_text(encoding="utf-8"))
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path} cannot be read: {error!r}") from error


def _load(path: Path) -> GreyImage:
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise ConfigError(f"{path} is not an image that can be read")
    return np.asarray(image, dtype=np.uint8)
