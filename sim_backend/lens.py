"""The simulated camera's projection: pinhole, Brown-Conrady distortion, vignetting."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_backend.config import CameraConfig

FloatArray = NDArray[np.float64]

_NEWTON_STEPS = 12


@dataclass(frozen=True, slots=True)
class Lens:
    """Which ray each pixel sees; pixel centres lie at integer coordinates."""

    width: int
    height: int
    focal_px: float
    cx_px: float
    cy_px: float
    distortion: FloatArray  # (5,) k1, k2, p1, p2, k3 as OpenCV orders and means them

    @property
    def ideal(self) -> bool:
        """Whether this is an undistorted pinhole with the principal point in the middle."""
        middle = (self.cx_px, self.cy_px) == ((self.width - 1) / 2, (self.height - 1) / 2)
        return middle and not np.any(self.distortion)

    def project(self, points: FloatArray) -> FloatArray:
        """Pixels (n, 2) of points (n, 3) in the camera frame."""
        return self.to_pixels(np.asarray(points[:, :2] / points[:, 2:3], float))

    def to_pixels(self, xy: FloatArray) -> FloatArray:
        """Pixels (n, 2) of undistorted normalised coordinates (n, 2)."""
        middle = np.array([self.cx_px, self.cy_px])
        return np.asarray(self.focal_px * self._distort(xy)[0] + middle, float)

    def to_rays(self, pixels: FloatArray) -> FloatArray:
        """Undistorted normalised coordinates (n, 2) of pixels (n, 2), by Newton's method.

        Raises ValueError where the distortion folds the image and no ray exists.
        """
        wanted: FloatArray = (pixels - np.array([self.cx_px, self.cy_px])) / self.focal_px
        xy: FloatArray = wanted.copy()
        if not np.any(self.distortion):
            return xy
        for _ in range(_NEWTON_STEPS):
            seen, jacobian = self._distort(xy)
            xy = xy + np.linalg.solve(jacobian, (wanted - seen)[..., None])[..., 0]
        seen, jacobian = self._distort(xy)
        off_px = self.focal_px * np.max(np.abs(seen - wanted))
        if not off_px < 1e-6 or np.min(np.linalg.det(jacobian)) <= 0.0:
            raise ValueError(
                f"camera.distortion = {self.distortion.tolist()} folds the image inside the frame"
            )
        return xy

    def ray_table(self) -> NDArray[np.float32]:
        """Undistorted normalised coordinates (2, height, width) of all pixels."""
        v, u = np.mgrid[0 : self.height, 0 : self.width]
        pixels = np.stack([u.ravel(), v.ravel()], axis=1).astype(float)
        rays = self.to_rays(pixels).T.reshape(2, self.height, self.width)
        return np.ascontiguousarray(rays, dtype=np.float32)

    def _distort(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distorted coordinates (n, 2) and their derivative (n, 2, 2)."""
        k1, k2, p1, p2, k3 = self.distortion
        x, y = xy[:, 0], xy[:, 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3))  # of radial: d/dx = slope x
        seen = np.stack(
            [
                x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
            ],
            axis=1,
        )
        jacobian = np.empty((len(xy), 2, 2))
        jacobian[:, 0, 0] = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
        jacobian[:, 0, 1] = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
        jacobian[:, 1, 0] = jacobian[:, 0, 1]
        jacobian[:, 1, 1] = radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
        return seen, jacobian


def lens_of(config: CameraConfig) -> Lens:
    """The configured lens."""
    middle = ((config.width - 1) / 2, (config.height - 1) / 2)
    cx, cy = middle if config.principal_point_px is None else config.principal_point_px
    return Lens(
        config.width, config.height, config.focal_px, cx, cy, np.array(config.distortion, float)
    )


def vignetting_gain(config: CameraConfig, lens: Lens) -> NDArray[np.float32]:
    """Relative sensitivity (height, width): 1 in the middle, 1 − vignetting in the far corner."""
    v, u = np.mgrid[0 : lens.height, 0 : lens.width].astype(float)
    r2 = (u - lens.cx_px) ** 2 + (v - lens.cy_px) ** 2
    gain: NDArray[np.float32] = (1.0 - config.vignetting * r2 / r2.max()).astype(np.float32)
    return gain
