"""How sharp the board's corners are in an image."""

import cv2
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
GreyImage = NDArray[np.uint8]

_HALF_PX = 7


def edge_width_px(image: GreyImage, corners: FloatArray) -> float:
    """The median width of the edges that meet in ``corners`` (n, 2), px.

    The contrast around a corner over the steepest slope there: about 2 for a sharp image, the
    blur's width for a blurred one. Infinite without a corner far enough from the border.
    """
    widths = []
    for u, v in np.round(corners).astype(int):
        patch = image[v - _HALF_PX : v + _HALF_PX + 1, u - _HALF_PX : u + _HALF_PX + 1]
        if u < _HALF_PX or v < _HALF_PX or patch.shape != (2 * _HALF_PX + 1,) * 2:
            continue
        low, high = np.percentile(patch, [10, 90])
        # Sobel's kernel sums eight differences over one pixel.
        slopes = [cv2.Sobel(patch, cv2.CV_32F, 1 - i, i) / 8.0 for i in range(2)]
        steepest = float(np.percentile(np.hypot(*slopes)[1:-1, 1:-1], 98))
        if high - low > 10:
            widths.append(float(high - low) / max(steepest, 1e-3))
    return float(np.median(widths)) if widths else float("inf")
