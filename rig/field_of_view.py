"""How much room the target's outline has left inside the image."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from estimator.vectors import cross

FloatArray = NDArray[np.float64]

_POINTS_PER_SIDE = 9
# Of a cylinder's side; shorter ones are hard to tell from other edges.
_HALF_STRETCH_RAD = 0.08


def border_planes(intrinsics: Intrinsics, shape: tuple[int, ...], margin_px: float) -> FloatArray:
    """Unit normals (4, 3), pointing inwards, of the planes through the image's borders.

    Left, right, top, bottom; ``shape`` is (height, width). A border that distortion bends is
    replaced by the straight one inside it.
    """
    height, width = shape[0], shape[1]
    low = np.array([margin_px, margin_px])
    high = np.array([width - 1.0 - margin_px, height - 1.0 - margin_px])
    along = np.linspace(0.0, 1.0, _POINTS_PER_SIDE)
    normals = np.zeros((4, 3))
    for axis in (0, 1):
        for k, value in enumerate((low[axis], high[axis])):
            pixels = np.empty((_POINTS_PER_SIDE, 2))
            pixels[:, axis] = value
            pixels[:, 1 - axis] = low[1 - axis] + along * (high[1 - axis] - low[1 - axis])
            bent = intrinsics.normalise(pixels)[:, axis]
            sign = 1.0 if k == 0 else -1.0
            limit = bent.max() if k == 0 else bent.min()
            normals[2 * axis + k, axis] = sign
            normals[2 * axis + k, 2] = -sign * limit
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def room_in_view(s: FloatArray, axis: FloatArray | None, planes: FloatArray) -> FloatArray:
    """Angles (4,) in rad from the outline to each of ``planes`` (4, 3); negative: outside.

    A sphere's outline is the cone of half-angle asin(1/‖s‖) about s. A cylinder leaves the
    image along its axis anyway: what counts is a stretch of its two sides where it is closest.
    """
    norm = float(np.linalg.norm(s))
    if norm <= 1.0:  # inside the target: no outline at all
        return np.full(len(planes), -np.pi / 2)
    half, centre = np.arcsin(1.0 / norm), s / norm
    if axis is None:
        return np.asarray(np.arcsin(np.clip(planes @ centre, -1.0, 1.0)) - half)
    aside = cross(axis, centre)
    sides = np.cos(half) * centre + np.sin(half) * np.outer([1.0, -1.0], aside)
    ends = np.concatenate([sides - _HALF_STRETCH_RAD * axis, sides + _HALF_STRETCH_RAD * axis])
    sides = ends / np.linalg.norm(ends, axis=1, keepdims=True)
    return np.asarray(np.arcsin(np.clip(planes @ sides.T, -1.0, 1.0)).min(axis=1))
