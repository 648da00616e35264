"""The controller's poses and speeds at the edge: rotation vectors in, matrices and tool twists out.

The controller reports poses as (x, y, z, rx, ry, rz) and speeds as (v, ω) of the TCP in base
axes. A tool that points down has a rotation vector of length π, where its sign flips from one
sample to the next: it becomes a matrix here and is never differenced.
"""

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def rotation_matrix(rx_rad: float, ry_rad: float, rz_rad: float) -> FloatArray:
    """The (3, 3) matrix of a rotation vector (Rodrigues); exact through |r| = π and 0."""
    angle = math.sqrt(rx_rad * rx_rad + ry_rad * ry_rad + rz_rad * rz_rad)
    if angle < 1e-9:
        a, b = 1.0, 0.5
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / (angle * angle)
    xx, yy, zz = rx_rad * rx_rad, ry_rad * ry_rad, rz_rad * rz_rad
    xy, xz, yz = b * rx_rad * ry_rad, b * rx_rad * rz_rad, b * ry_rad * rz_rad
    return np.array(
        [
            [1.0 - b * (yy + zz), xy - a * rz_rad, xz + a * ry_rad],
            [xy + a * rz_rad, 1.0 - b * (xx + zz), yz - a * rx_rad],
            [xz - a * ry_rad, yz + a * rx_rad, 1.0 - b * (xx + yy)],
        ]
    )


def pose_matrix(pose: FloatArray) -> FloatArray:
    """``T_base_tool`` (4, 4) of a controller pose (6,) in m and rad."""
    T = np.eye(4)
    T[:3, :3] = rotation_matrix(float(pose[3]), float(pose[4]), float(pose[5]))
    T[:3, 3] = pose[:3]
    return T


def to_base_axes(R_base_tool: FloatArray, twist_tool: FloatArray) -> FloatArray:
    """The tool's twist (6,) expressed in base axes, still of the TCP: what ``speedL`` takes."""
    return np.concatenate([R_base_tool @ twist_tool[:3], R_base_tool @ twist_tool[3:]])


def to_tool_axes(R_base_tool: FloatArray, twist_base: FloatArray) -> FloatArray:
    """The TCP's speed (6,) in base axes expressed in the tool's own axes."""
    return np.concatenate([R_base_tool.T @ twist_base[:3], R_base_tool.T @ twist_base[3:]])
