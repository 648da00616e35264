"""An image with the fitted outline drawn on it, in colour."""

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import GreyImage
from estimator.image.feature import Feature
from estimator.image.intrinsics import Intrinsics
from estimator.image.outline import outline_px

ColourImage = NDArray[np.uint8]  # (height, width, 3)

_RED_BGR = (51, 85, 255)
_SHIFT = 3  # cv2 draws at fractions of a pixel given as fixed-point numbers
_FAR_PX = 1e5  # beyond it they would overflow


def outlined(image: GreyImage, feature: Feature | None, intrinsics: Intrinsics) -> ColourImage:
    """A BGR copy of ``image`` with the outline that ``feature`` has in it."""
    out: ColourImage = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    if feature is None or not float(feature.s @ feature.s) > 1.0:
        return out
    shape = (image.shape[0], image.shape[1])
    for line in outline_px(feature, intrinsics, shape):
        points = np.clip(line[np.all(np.isfinite(line), axis=1)], -_FAR_PX, _FAR_PX)
        fixed = np.round(points * 2**_SHIFT).astype(np.int32).reshape(-1, 1, 2)
        cv2.polylines(out, [fixed], False, _RED_BGR, 2, cv2.LINE_AA, _SHIFT)
    return out
