"""A grey picture on a terminal, its numbers in words, and as a file."""

from pathlib import Path

import numpy as np
from rich.text import Text

from drivers.errors import ConfigError
from drivers.interfaces import Frame, GreyImage

_SATURATED = 250


def half_blocks(image: GreyImage, columns: int, rows: int) -> Text:
    """The picture with two pixels in each character, as large as the terminal allows."""
    import cv2

    height, width = image.shape
    scale = min(max(columns, 8) / width, 2 * max(rows, 4) / height, 1.0)
    size = (max(1, round(width * scale)), 2 * max(1, round(height * scale / 2)))
    small = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
    text = Text()
    for upper, lower in zip(small[0::2], small[1::2], strict=True):
        for above, below in zip(upper.tolist(), lower.tolist(), strict=True):
            text.append("▀", style=f"rgb({above},{above},{above}) on rgb({below},{below},{below})")
        text.append("\n")
    return text


def numbers(frame: Frame, age_s: float) -> str:
    """What the picture is like, in one line."""
    image = frame.image
    saturated = float(np.mean(image >= _SATURATED))
    # A stamp made on arrival hides the latency, so its age would say nothing.
    age = f", {1e3 * age_s:.1f} ms old" if frame.stamp_source in ("kernel", "stream") else ""
    return (
        f"{image.shape[1]}x{image.shape[0]}, grey {image.min()} to {image.max()}, "
        f"mean {image.mean():.1f}, {100 * saturated:.1f} % saturated, "
        f"exposure {1e3 * frame.exposure_s:.2f} ms, stamp {frame.stamp_source}{age}"
    )


def save_image(path: Path, image: GreyImage) -> None:
    """Write the picture; raises ConfigError when that is not possible."""
    import cv2

    try:
        done, data = cv2.imencode(path.suffix or ".png", image)
        if not done:
            raise OSError("the format is not known")
        path.write_bytes(np.asarray(data).tobytes())
    except (OSError, cv2.error) as error:
        raise ConfigError(f"cannot write {path}: {error}") from error
