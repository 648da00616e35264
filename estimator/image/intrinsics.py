"""The camera's internal geometry: focal lengths, principal point, Brown-Conrady distortion."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Fixed-point steps of the inverse distortion; each gains about 1.5 digits for |k1| r² < 0.05.
_UNDISTORT_STEPS = 20


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """Pinhole with Brown-Conrady distortion; pixel centres lie at integer coordinates.

    ``distortion`` holds (k1, k2, p1, p2, k3) in OpenCV's order and meaning.
    """

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: FloatArray = field(default_factory=lambda: np.zeros(5))  # (5,)

    @property
    def distorted(self) -> bool:
        """Whether any distortion coefficient differs from zero."""
        return bool(np.any(self.distortion != 0.0))

    def project(self, points: FloatArray) -> FloatArray:
        """Pixels (n, 2) of camera-frame points or normalised points (n, 2 or 3)."""
        p = np.asarray(points, dtype=float)
        xy = p[..., :2] / p[..., 2:3] if p.shape[-1] == 3 else p
        xy = self._distort(xy)
        return np.stack(
            [self.fx_px * xy[..., 0] + self.cx_px, self.fy_px * xy[..., 1] + self.cy_px], axis=-1
        )

    def normalise(self, pixels: FloatArray) -> FloatArray:
        """Undistorted normalised coordinates (n, 2) of pixels (n, 2)."""
        u = np.asarray(pixels, dtype=float)
        distorted = np.stack(
            [(u[..., 0] - self.cx_px) / self.fx_px, (u[..., 1] - self.cy_px) / self.fy_px], axis=-1
        )
        if not self.distorted:
            return distorted
        xy = distorted.copy()
        for _ in range(_UNDISTORT_STEPS):
            xy = xy - (self._distort(xy) - distorted)
        return xy

    def _distort(self, xy: FloatArray) -> FloatArray:
        k1, k2, p1, p2, k3 = self.distortion
        x, y = xy[..., 0], xy[..., 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return np.stack([x * radial + dx, y * radial + dy], axis=-1)
