"""The reduced image on which detection looks, and where its pixels lie without distortion.

Spheres are sought in the stereographic picture of the view sphere, where every sphere's outline
is an exact circle, also far off the axis and through a distorting lens; cylinders in the pinhole
picture, where every outline line is straight.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from estimator.image.edges_camera import GreyImage
from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.jit import jit

Projection = Literal["stereographic", "pinhole"]
FloatImage = NDArray[np.float32]

_TARGET_WIDTH_PX = 160


@dataclass(frozen=True, slots=True)
class DetectGrid:
    """Maps from the reduced image to plane coordinates, in reduced pixels about the axis."""

    factor: int  # image pixels per reduced pixel
    scale_px: float  # reduced pixels per unit of the plane's coordinates at the axis
    projection: Projection
    xy: FloatArray  # (height, width, 2) plane coordinates
    gradient: FloatArray  # (height, width, 2, 2) turns an image gradient into the plane's

    def ray(self, x: float, y: float) -> FloatArray:
        """The unit ray (3,) of plane coordinates."""
        a, b = x / self.scale_px, y / self.scale_px
        if self.projection == "pinhole":
            p = np.array([a, b, 1.0])
            return p / float(np.linalg.norm(p))
        r2 = 0.25 * (a * a + b * b)
        return np.array([a, b, 1.0 - r2]) / (1.0 + r2)


def make_grid(intrinsics: Intrinsics, shape: tuple[int, int], projection: Projection) -> DetectGrid:
    """The grid for images of ``shape`` (height, width)."""
    factor = max(1, round(max(shape) / _TARGET_WIDTH_PX))
    height, width = shape[0] // factor, shape[1] // factor
    scale_px = intrinsics.fx_px / factor
    u = np.arange(width) * factor + 0.5 * (factor - 1)
    v = np.arange(height) * factor + 0.5 * (factor - 1)

    def plane(du: float, dv: float) -> FloatArray:
        pixels = np.stack(np.meshgrid(u + du, v + dv), axis=-1)
        xy = intrinsics.normalise(pixels)
        if projection == "stereographic":
            r2 = np.sum(xy * xy, axis=-1, keepdims=True)
            xy = 2.0 * xy / (1.0 + np.sqrt(1.0 + r2))
        return scale_px * xy

    h = 0.5 * factor
    jacobian = np.stack([plane(h, 0.0) - plane(-h, 0.0), plane(0.0, h) - plane(0.0, -h)], axis=-1)
    # A gradient is a covector: it turns with the inverse transpose of d(plane)/d(pixel).
    gradient = np.linalg.inv(jacobian).swapaxes(-1, -2)
    return DetectGrid(factor, scale_px, projection, plane(0.0, 0.0), np.ascontiguousarray(gradient))


def grid_for(
    intrinsics: Intrinsics, shape: tuple[int, int], target: Literal["sphere", "cylinder"]
) -> DetectGrid:
    """The grid on which ``target`` is sought; made once per camera and image shape."""
    k = intrinsics
    return _cached_grid(
        k.fx_px, k.fy_px, k.cx_px, k.cy_px, tuple(k.distortion.tolist()), shape,
        "stereographic" if target == "sphere" else "pinhole",
    )  # fmt: skip


@lru_cache(maxsize=8)
def _cached_grid(
    fx_px: float, fy_px: float, cx_px: float, cy_px: float, distortion: tuple[float, ...],
    shape: tuple[int, int], projection: Projection,
) -> DetectGrid:  # fmt: skip
    return make_grid(
        Intrinsics(fx_px, fy_px, cx_px, cy_px, np.array(distortion)), shape, projection
    )


def reduce_image(image: GreyImage, factor: int) -> GreyImage:
    """The image averaged over ``factor`` x ``factor`` blocks and slightly smoothed."""
    height, width = image.shape[0] // factor, image.shape[1] // factor
    small = image[: height * factor, : width * factor]
    if factor > 1:
        small = _grey(cv2.resize(small, (width, height), interpolation=cv2.INTER_AREA))
    return _grey(cv2.GaussianBlur(small, (3, 3), 0.8))


def _grey(image: NDArray[Any]) -> GreyImage:
    """OpenCV's stubs do not carry the type through: these images are uint8 all along."""
    return image.astype(np.uint8, copy=False)


@jit
def _slopes(small: GreyImage) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Grey levels per reduced pixel along u and v, and their norm; zero on the border."""
    height, width = small.shape
    along_u, along_v = np.zeros((height, width)), np.zeros((height, width))
    size = np.zeros((height, width))
    for i in range(1, height - 1):
        for j in range(1, width - 1):
            gu = 0.5 * (float(small[i, j + 1]) - float(small[i, j - 1]))
            gv = 0.5 * (float(small[i + 1, j]) - float(small[i - 1, j]))
            along_u[i, j], along_v[i, j] = gu, gv
            size[i, j] = np.sqrt(gu * gu + gv * gv)
    return along_u, along_v, size


@jit
def _crests(
    along_u: FloatArray, along_v: FloatArray, size: FloatArray, least: float, most: int
) -> tuple[NDArray[np.uint8], int]:
    """Marks (height, width) of pixels on the crest of an edge, and how many they are."""
    height, width = size.shape
    keep = np.zeros((height, width), np.uint8)
    histogram = np.zeros(256, np.int64)
    for i in range(1, height - 1):
        for j in range(1, width - 1):
            g = size[i, j]
            if g < least:
                continue
            if abs(along_u[i, j]) > abs(along_v[i, j]):
                crest = g >= size[i, j - 1] and g >= size[i, j + 1]
            else:
                crest = g >= size[i - 1, j] and g >= size[i + 1, j]
            if crest:
                level = min(255, int(g))
                keep[i, j] = max(1, level)
                histogram[level] += 1
    level, total = 255, histogram[255]
    while level > 0 and total + histogram[level - 1] <= most:
        level -= 1
        total += histogram[level]
    for i in range(height):
        for j in range(width):
            if keep[i, j] < level:
                keep[i, j] = 0
    return keep, total


@jit
def edge_list(
    small: GreyImage, xy: FloatArray, gradient: FloatArray, least: float, most: int
) -> FloatArray:
    """Edge pixels (n, 5): plane x, y, unit direction towards the bright side, strength.

    Strength is grey levels per reduced pixel; at most ``most`` edges, the strongest, unless more
    than that are saturated.
    """
    along_u, along_v, size = _slopes(small)
    keep, total = _crests(along_u, along_v, size, least, most)
    edges = np.empty((total, 5))
    count = 0
    for i in range(keep.shape[0]):
        for j in range(keep.shape[1]):
            if keep[i, j] == 0 or count == total:
                continue
            gu, gv = along_u[i, j], along_v[i, j]
            px = gradient[i, j, 0, 0] * gu + gradient[i, j, 0, 1] * gv
            py = gradient[i, j, 1, 0] * gu + gradient[i, j, 1, 1] * gv
            norm = np.sqrt(px * px + py * py) + 1e-300
            edges[count, 0], edges[count, 1] = xy[i, j, 0], xy[i, j, 1]
            edges[count, 2], edges[count, 3] = px / norm, py / norm
            edges[count, 4] = size[i, j]
            count += 1
    return edges[:count]
