"""Pixels to rays and back for compiled code: the maps of ``Intrinsics``, one point at a time."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.jit import jit

GreyImage = NDArray[np.uint8]

_UNDISTORT_STEPS = 30
_UNDISTORT_DONE = 1e-13


def pack_camera(intrinsics: Intrinsics) -> FloatArray:
    """(fx, fy, cx, cy, k1, k2, p1, p2, k3) as one array (9,), the form compiled code takes."""
    k = intrinsics
    return np.concatenate([[k.fx_px, k.fy_px, k.cx_px, k.cy_px], np.asarray(k.distortion, float)])


@jit
def distort(camera: FloatArray, x: float, y: float) -> tuple[float, float]:
    """Distorted normalised coordinates of the ideal ones (Brown-Conrady)."""
    r2 = x * x + y * y
    radial = 1.0 + r2 * (camera[4] + r2 * (camera[5] + r2 * camera[8]))
    p1, p2 = camera[6], camera[7]
    xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    return xd, yd


@jit
def pixel_of(camera: FloatArray, x: float, y: float) -> tuple[float, float]:
    """The pixel of ideal normalised coordinates."""
    xd, yd = distort(camera, x, y)
    return camera[0] * xd + camera[2], camera[1] * yd + camera[3]


@jit
def normalised_of(camera: FloatArray, u: float, v: float) -> tuple[float, float]:
    """Ideal normalised coordinates of a pixel, by fixed-point iteration."""
    xd = (u - camera[2]) / camera[0]
    yd = (v - camera[3]) / camera[1]
    x, y = xd, yd
    for _ in range(_UNDISTORT_STEPS):
        xi, yi = distort(camera, x, y)
        ex, ey = xi - xd, yi - yd
        x -= ex
        y -= ey
        if abs(ex) + abs(ey) < _UNDISTORT_DONE:
            break
    return x, y


@jit
def bilinear(image: GreyImage, u: float, v: float) -> float:
    """Grey value between pixels; NaN outside the image."""
    height, width = image.shape
    if not (0.0 <= u <= width - 1.0 and 0.0 <= v <= height - 1.0):
        return np.nan
    i = min(int(v), height - 2)
    j = min(int(u), width - 2)
    fu, fv = u - j, v - i
    top = (1.0 - fu) * image[i, j] + fu * image[i, j + 1]
    bottom = (1.0 - fu) * image[i + 1, j] + fu * image[i + 1, j + 1]
    return float((1.0 - fv) * top + fv * bottom)
