"""The simulated camera's projection: pinhole, Brown-Conrady distortion, vignetting."""

import math
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
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: FloatArray  # (5,) k1, k2, p1, p2, k3 as OpenCV orders and means them

    @property
    def focal_px(self) -> float:
        """One focal length for both axes, for what need not be exact."""
        return math.sqrt(self.fx_px * self.fy_px)

    @property
    def ideal(self) -> bool:
        """Whether this is an undistorted pinhole, its principal point in the image's middle."""
        middle = (self.cx_px, self.cy_px) == ((self.width - 1) / 2, (self.height - 1) / 2)
        return middle and self.fx_px == self.fy_px and not np.any(self.distortion)

    def project(self, points: FloatArray) -> FloatArray:
        """Pixels (n, 2) of points (n, 3) in the camera frame."""
        return self.to_pixels(np.asarray(points[:, :2] / points[:, 2:3], float))

    def to_pixels(self, xy: FloatArray) -> FloatArray:
        """Pixels (n, 2) of undistorted normalised coordinates (n, 2)."""
        focal, middle = self._pinhole()
        return np.asarray(focal * self._distort(xy)[0] + middle, float)

    def to_rays(self, pixels: FloatArray) -> FloatArray:
        """Undistorted normalised coordinates (n, 2) of pixels (n, 2), by Newton's method.

        Raises ValueError where the distortion folds the image and no ray exists.
        """
        focal, middle = self._pinhole()
        wanted: FloatArray = (pixels - middle) / focal
        xy: FloatArray = wanted.copy()
        if not np.any(self.distortion):
            return xy
        for _ in range(_NEWTON_STEPS):
            seen, jacobian = self._distort(xy)
            step = _solved(jacobian, wanted - seen)
            xy = xy + step
            if np.max(np.abs(step)) < 1e-14:
                break
        seen, jacobian = self._distort(xy)
        off_px = np.max(np.abs(focal * (seen - wanted)))
        if not off_px < 1e-6 or np.min(np.linalg.det(jacobian)) <= 0.0:
            raise ValueError(
                f"camera.distortion = {self.distortion.tolist()} folds the image inside the frame"
            )
        return xy

    def ray_table(self) -> NDArray[np.float32]:
        """Undistorted normalised coordinates (2, height, width) of all pixels."""
        return self._table(self.height, self.width, 0.0)

    def corner_ray_table(self) -> NDArray[np.float32]:
        """As ``ray_table``, of the pixels' corners: (2, height + 1, width + 1).

        Entry (v, u) is the corner that pixel (v, u) shares with its upper left neighbour.
        """
        return self._table(self.height + 1, self.width + 1, -0.5)

    def _table(self, rows: int, columns: int, first: float) -> NDArray[np.float32]:
        v, u = np.mgrid[0:rows, 0:columns] + first
        rays = self.to_rays(np.stack([u.ravel(), v.ravel()], axis=1))
        return np.ascontiguousarray(rays.T.reshape(2, rows, columns), dtype=np.float32)

    def _pinhole(self) -> tuple[FloatArray, FloatArray]:
        """Focal lengths and principal point, (2,) each."""
        return np.array([self.fx_px, self.fy_px]), np.array([self.cx_px, self.cy_px])

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


def _solved(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions (n, 2) of n systems (n, 2, 2); not finite where one is singular."""
    a, b, c, d = matrices.reshape(-1, 4).T
    x, y = right.T
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        scale = 1.0 / (a * d - b * c)
        return np.stack([(d * x - b * y) * scale, (a * y - c * x) * scale], axis=1)


def lens_of(config: CameraConfig) -> Lens:
    """The configured lens."""
    return Lens(
        width=config.width,
        height=config.height,
        fx_px=config.fx or config.focal_px,
        fy_px=config.fy or config.focal_px,
        cx_px=(config.width - 1) / 2 if config.cx is None else config.cx,
        cy_px=(config.height - 1) / 2 if config.cy is None else config.cy,
        distortion=np.array(config.distortion, float),
    )


def vignetting_gain(config: CameraConfig, lens: Lens) -> NDArray[np.float32]:
    """Relative sensitivity (height, width): 1 in the middle, 1 − vignetting in the far corner."""
    v, u = np.mgrid[0 : lens.height, 0 : lens.width].astype(float)
    r2 = (u - lens.cx_px) ** 2 + (v - lens.cy_px) ** 2
    gain: NDArray[np.float32] = (1.0 - config.vignetting * r2 / r2.max()).astype(np.float32)
    return gain
