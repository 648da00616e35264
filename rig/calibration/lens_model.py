"""How many distortion coefficients to fit: from none to all five of Brown and Conrady."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_NO_RADIAL = cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
_NO_TANGENTIAL = cv2.CALIB_ZERO_TANGENT_DIST


@dataclass(frozen=True, slots=True)
class LensModel:
    """Which coefficients are fitted; the others are zero."""

    name: str
    flags: int  # of cv2.calibrateCamera
    coefficients: tuple[bool, bool, bool, bool, bool]  # k1, k2, p1, p2, k3

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which of the nine intrinsics (9,) are fitted."""
        return np.array([True] * 4 + list(self.coefficients))


PINHOLE = LensModel("pinhole", _NO_RADIAL | _NO_TANGENTIAL, (False,) * 5)
FULL = LensModel("k1 k2 p1 p2 k3", 0, (True,) * 5)
# From few to many.
MODELS = (
    PINHOLE,
    LensModel(
        "k1",
        _NO_TANGENTIAL | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3,
        (True, False, False, False, False),
    ),
    LensModel("k1 k2", _NO_TANGENTIAL | cv2.CALIB_FIX_K3, (True, True, False, False, False)),
    LensModel("k1 k2 p1 p2", cv2.CALIB_FIX_K3, (True, True, True, True, False)),
    FULL,
)


def folds(values: FloatArray, size: tuple[int, int]) -> bool:
    """Whether the distortion of the intrinsics (9,) turns back inside an image of ``size``.

    Where the distorted radius no longer grows with the ray's angle, two rays share a pixel and
    pixels further out see nothing.
    """
    fx, fy, cx, cy, k1, k2, _, _, k3 = values
    far = np.hypot(max(cx, size[0] - 1 - cx) / fx, max(cy, size[1] - 1 - cy) / fy)
    r = np.linspace(0.0, 1.5 * far, 200)
    seen = r * (1.0 + r**2 * (k1 + r**2 * (k2 + r**2 * k3)))
    growing = np.diff(seen) > 0.0
    reached = seen[1:] >= far
    until = int(np.argmax(reached)) if reached.any() else len(growing) - 1
    return not (reached.any() and bool(growing[: until + 1].all()))
