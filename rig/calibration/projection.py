"""Projecting board points, with derivatives with respect to the pose and the intrinsics."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics

FloatArray = NDArray[np.float64]

# The intrinsics as one vector, in this order.
NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
COUNT = len(NAMES)


def to_vector(intrinsics: Intrinsics) -> FloatArray:
    """The intrinsics as a vector (9,) in the order of ``NAMES``."""
    i = intrinsics
    return np.array([i.fx_px, i.fy_px, i.cx_px, i.cy_px, *i.distortion], dtype=float)


def from_vector(values: FloatArray) -> Intrinsics:
    """The intrinsics of a vector (9,) in the order of ``NAMES``."""
    fx, fy, cx, cy = (float(value) for value in values[:4])
    return Intrinsics(fx, fy, cx, cy, np.array(values[4:], dtype=float))


def camera_matrix(intrinsics: Intrinsics) -> FloatArray:
    """The (3, 3) matrix that OpenCV takes."""
    i = intrinsics
    return np.array([[i.fx_px, 0.0, i.cx_px], [0.0, i.fy_px, i.cy_px], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True)
class Projection:
    """Pixels and how they change, for m poses of n points each."""

    pixels: FloatArray  # (m, n, 2)
    by_pose: FloatArray  # (m, n, 2, 6) for T_camera_board ← exp(ξ) T_camera_board
    by_intrinsics: FloatArray  # (m, n, 2, 9)
    by_scale: FloatArray  # (m, n, 2) for the board growing about its origin
    depth_m: FloatArray  # (m, n)


def project(values: FloatArray, T_camera_board: FloatArray, points_m: FloatArray) -> Projection:
    """Project ``points_m`` (m, n, 3) from poses (m, 4, 4) through the intrinsics (9,).

    Points behind the camera give numbers without meaning; see ``depth_m``.
    """
    turned = points_m @ np.swapaxes(T_camera_board[:, :3, :3], 1, 2)
    p = turned + T_camera_board[:, None, :3, 3]
    depth = np.where(np.abs(p[..., 2]) < 1e-9, 1e-9, p[..., 2])
    xy = p[..., :2] / depth[..., None]
    seen, by_xy, by_coefficients = _distort(xy, values[4:])
    f = values[:2]
    chain = f[:, None] * by_xy  # (m, n, 2, 2) pixels by normalised coordinates
    by_point = np.empty((*xy.shape[:2], 2, 3))
    by_point[..., :2] = chain / depth[..., None, None]
    by_point[..., 2] = -np.einsum("mnij,mnj->mni", chain, xy) / depth[..., None]
    by_pose = np.empty((*xy.shape[:2], 2, 6))
    by_pose[..., :3] = by_point
    # d p = ω × p: the rotational columns are the rows of by_point crossed into p.
    by_pose[..., 3:] = np.cross(p[..., None, :], by_point)
    by_intrinsics = np.zeros((*xy.shape[:2], 2, COUNT))
    by_intrinsics[..., 0, 0] = seen[..., 0]
    by_intrinsics[..., 1, 1] = seen[..., 1]
    by_intrinsics[..., 0, 2] = by_intrinsics[..., 1, 3] = 1.0
    by_intrinsics[..., 4:] = f[:, None] * by_coefficients
    return Projection(
        pixels=f * seen + values[2:4],
        by_pose=by_pose,
        by_intrinsics=by_intrinsics,
        by_scale=np.einsum("mnij,mnj->mni", by_point, turned),
        depth_m=p[..., 2],
    )


def _distort(xy: FloatArray, d: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distorted coordinates, their derivative by ``xy``, and by (k1, k2, p1, p2, k3)."""
    k1, k2, p1, p2, k3 = d
    x, y = xy[..., 0], xy[..., 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3))
    tangent = np.stack([[2.0 * x * y, r2 + 2.0 * x * x], [r2 + 2.0 * y * y, 2.0 * x * y]])
    seen = xy * radial[..., None]
    seen[..., 0] += p1 * tangent[0, 0] + p2 * tangent[0, 1]
    seen[..., 1] += p1 * tangent[1, 0] + p2 * tangent[1, 1]
    by_xy = np.empty((*xy.shape, 2))
    by_xy[..., 0, 0] = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    by_xy[..., 0, 1] = by_xy[..., 1, 0] = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    by_xy[..., 1, 1] = radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    by_coefficients = np.empty((*xy.shape, 5))
    powers = (r2, r2 * r2, r2 * r2 * r2)
    for column, power in zip((0, 1, 4), powers, strict=True):
        by_coefficients[..., column] = xy * power[..., None]
    for i in range(2):
        by_coefficients[..., i, 2] = tangent[i, 0]
        by_coefficients[..., i, 3] = tangent[i, 1]
    return seen, by_xy, by_coefficients
