"""What an image says about the target: the features s, or the reason there are none."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Feature:
    """The scaled position s = P0 / R of the target, measured in one image.

    Sphere: P0 is the centre. Cylinder: P0 is the axis point closest to the camera's centre
    (eq. 16) and ``axis`` the unit direction a, with aᵀs = 0; its sign is arbitrary but kept
    from image to image while tracking. Of n points s holds the image coordinates instead, (x, y)
    of one after the other (2n,).
    """

    s: FloatArray  # (3,), or (2n,)
    covariance: FloatArray  # of s, (3, 3) or (2n, 2n)
    axis: FloatArray | None = None  # (3,), cylinder only


@dataclass(frozen=True, slots=True)
class Measurement:
    """One image's result: a feature, or None and the reason in words."""

    feature: Feature | None
    reason: str = ""  # empty when found

    @property
    def found(self) -> bool:
        """Whether a trustworthy outline was found."""
        return self.feature is not None
