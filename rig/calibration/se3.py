"""Rigid motions: exponential, logarithm, adjoint; all take stacks along leading axes.

Twists ξ are (v, ω), linear part first. ``exp(ξ) @ T`` moves in the axes of T's left frame.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

_SMALL_RAD = 1e-4  # below this the series of the coefficients is exact to 1e-16


def cross_matrix(a: FloatArray) -> FloatArray:
    """The matrices (..., 3, 3) that take the cross product with ``a`` (..., 3)."""
    out = np.zeros((*a.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2] = -a[..., 2], a[..., 1]
    out[..., 1, 0], out[..., 1, 2] = a[..., 2], -a[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -a[..., 1], a[..., 0]
    return out


def exp(twist: FloatArray) -> FloatArray:
    """The poses (..., 4, 4) reached from the identity by unit time of the twists (..., 6)."""
    v, w = twist[..., :3], twist[..., 3:]
    W = cross_matrix(w)
    a, b = _coefficients(np.linalg.norm(w, axis=-1))
    V = np.eye(3) + a[..., None, None] * W + b[..., None, None] * (W @ W)
    return pose(_matrices(w), (V @ v[..., None])[..., 0])


def log(T: FloatArray) -> FloatArray:
    """The twists (..., 6) with ``exp(log(T)) = T``; turns of at most π."""
    w = rotation_vectors(T[..., :3, :3])
    W = cross_matrix(w)
    a, b = _coefficients(np.linalg.norm(w, axis=-1))
    V = np.eye(3) + a[..., None, None] * W + b[..., None, None] * (W @ W)
    v = np.linalg.solve(V, T[..., :3, 3:4])[..., 0]
    return np.concatenate([v, w], axis=-1)


def pose(R: FloatArray, t_m: FloatArray) -> FloatArray:
    """The poses (..., 4, 4) of rotations (..., 3, 3) and translations (..., 3)."""
    shape = np.broadcast_shapes(R.shape[:-2], t_m.shape[:-1])
    out = np.zeros((*shape, 4, 4))
    out[..., :3, :3] = R
    out[..., :3, 3] = t_m
    out[..., 3, 3] = 1.0
    return out


def inverse(T: FloatArray) -> FloatArray:
    """The inverses of the poses (..., 4, 4)."""
    Rt = np.swapaxes(T[..., :3, :3], -1, -2)
    return pose(Rt, -(Rt @ T[..., :3, 3:4])[..., 0])


def adjoint(T_a_b: FloatArray) -> FloatArray:
    """The matrices (..., 6, 6) that express a twist given in b's axes in a's.

    ``T exp(ξ) = exp(adjoint(T) ξ) T``.
    """
    R = T_a_b[..., :3, :3]
    out = np.zeros((*T_a_b.shape[:-2], 6, 6))
    out[..., :3, :3] = R
    out[..., 3:, 3:] = R
    out[..., :3, 3:] = cross_matrix(T_a_b[..., :3, 3]) @ R
    return out


def rotation_vectors(R: FloatArray) -> FloatArray:
    """Rotation vectors (..., 3) of rotation matrices (..., 3, 3)."""
    flat = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_rotvec()
    return np.asarray(flat.reshape(R.shape[:-1]), dtype=float)


def from_xyz_rotvec(xyz_m: FloatArray, rotvec_rad: FloatArray) -> FloatArray:
    """The pose (4, 4) of a translation (3,) and a rotation vector (3,)."""
    return pose(_matrices(np.asarray(rotvec_rad, dtype=float)), np.asarray(xyz_m, dtype=float))


def mean_rotation(R: FloatArray) -> FloatArray:
    """The rotation (3, 3) nearest to all of ``R`` (n, 3, 3) in the least-squares sense."""
    return np.asarray(Rotation.from_matrix(R).mean().as_matrix(), dtype=float)


def _matrices(w: FloatArray) -> FloatArray:
    flat = Rotation.from_rotvec(w.reshape(-1, 3)).as_matrix()
    return np.asarray(flat.reshape(*w.shape, 3), dtype=float)


def _coefficients(angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(1 − cos θ)/θ² and (θ − sin θ)/θ³."""
    small = angle < _SMALL_RAD
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 0.5 - angle**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    b = np.where(small, 1.0 / 6.0 - angle**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    return a, b
