"""Raw camera buffers to grey images: the luminance as it was sent, no detour by colour."""

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import GreyImage

# Where the luminance lies: (bytes per pixel, offset), all other bytes are colour.
_PACKED = {"YUYV": (2, 0), "YUY2": (2, 0), "YVYU": (2, 0), "UYVY": (2, 1), "VYUY": (2, 1)}
_LUMINANCE_FIRST = ("GREY", "Y800", "NV12", "NV21", "YU12", "YV12", "422P", "NV16")
_JPEG = ("MJPG", "JPEG")

RAW_FORMATS = (*_PACKED, *_LUMINANCE_FIRST, *_JPEG)

_JPEG_END = b"\xff\xd9"


def raw_to_grey(data: NDArray[np.uint8], fourcc: str, width: int, height: int) -> GreyImage | None:
    """The (height, width) luminance of one buffer; None when it is cut short or damaged.

    Raises ValueError for a format not in ``RAW_FORMATS``.
    """
    flat = data.reshape(-1)
    pixels = width * height
    if fourcc in _JPEG:
        image = jpeg_to_grey(flat.tobytes())
        return image if image is not None and image.shape == (height, width) else None
    if fourcc in _PACKED:
        size, offset = _PACKED[fourcc]
        if flat.size < size * pixels:
            return None
        return np.ascontiguousarray(flat[offset : size * pixels : size].reshape(height, width))
    if fourcc in _LUMINANCE_FIRST:
        return flat[:pixels].reshape(height, width).copy() if flat.size >= pixels else None
    raise ValueError(f"cannot read {fourcc}; known: {', '.join(RAW_FORMATS)}")


def jpeg_to_grey(data: bytes) -> GreyImage | None:
    """The luminance of a JPEG; None when it does not decode or its end is missing."""
    import cv2

    # A decoder fills what is missing with grey and only warns; some cameras pad with zeros.
    if not data.rstrip(b"\0").endswith(_JPEG_END):
        return None
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    return None if image is None else np.asarray(image, dtype=np.uint8)
