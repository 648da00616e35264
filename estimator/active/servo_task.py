"""Where the target is wanted in the image, and how far away."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.estimate import Estimate

FloatArray = NDArray[np.float64]

_WELL_WITHIN = 0.5


@dataclass(frozen=True, slots=True)
class ServoTask:
    """The target's centre (a cylinder's nearest axis point) on a ray, its surface at a distance.

    As s has it: s wanted = (1 + χ distance) bearing, three numbers for a twist of six. Raises
    ValueError for a bearing that is no unit vector in front of the camera, or anything else that
    is not positive.
    """

    bearing: FloatArray  # (3,) unit, camera frame
    distance_m: float  # from the camera's centre to the target's surface
    focal_px: float
    tolerance_px: float
    tolerance_m: float

    def __post_init__(self) -> None:
        length = float(np.linalg.norm(self.bearing))
        if not (abs(length - 1.0) < 1e-9 and self.bearing[2] > 0.0):
            raise ValueError(f"a bearing is a unit vector with z > 0, not {self.bearing}")
        if not min(self.distance_m, self.focal_px, self.tolerance_px, self.tolerance_m) > 0.0:
            raise ValueError("distance, focal length and tolerances must be positive")

    def off_px(self, estimate: Estimate) -> float:
        """How far off its place the target is in the image, lens distortion apart."""
        if estimate.s[2] <= 0.0:
            return math.inf
        off = estimate.s[:2] / estimate.s[2] - self.bearing[:2] / self.bearing[2]
        return self.focal_px * float(np.linalg.norm(off))

    def off_m(self, estimate: Estimate) -> float | None:
        """How much too far away the target is, by R̂; None while that is not positive."""
        if estimate.chi <= 0.0:
            return None
        return (float(np.linalg.norm(estimate.s)) - 1.0) / estimate.chi - self.distance_m

    def done(self, estimate: Estimate) -> bool:
        """Whether both are well within their tolerances: what coming to rest adds has room."""
        off_m = self.off_m(estimate)
        if off_m is None or abs(off_m) > _WELL_WITHIN * self.tolerance_m:
            return False
        return self.off_px(estimate) <= _WELL_WITHIN * self.tolerance_px
