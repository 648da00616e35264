"""One step of the Kalman filter on x = (s, χ): first along a motion, then with an image.

The target is a sphere, or a cylinder whose axis ``axis`` (3,) is known; zeros stand for none.
A cylinder's s lies across its axis, so P (4, 4) has no variance along it.
"""

import math

import numpy as np
from numpy.typing import NDArray

from estimator.jit import jit, jit_template

FloatArray = NDArray[np.float64]

# No image is more exact: this share of s is its least standard deviation.
_FINEST = 1e-7


@jit
def moved(
    x: FloatArray,
    P: FloatArray,
    R: FloatArray,
    d: FloatArray,
    axis: FloatArray,
    twist_spectrum: FloatArray,
    duration_s: float,
    least_speed_m_s: float,
) -> tuple[FloatArray, FloatArray]:
    """x (4,) and P (4, 4) after the motion R (3, 3), d (3,), see ``displacement``.

    ``twist_spectrum`` (6, 6) is the covariance of a measured twist times the time from sample to
    sample. Slower than ``least_speed_m_s`` the shift counts as noise: it moves s and makes it
    less certain, but tells nothing about χ. Products of measured noises would tell, wrongly.
    """
    across = np.eye(3)
    for i in range(3):
        for j in range(3):
            across[i, j] -= axis[i] * axis[j]
    shift = across @ d
    F = np.zeros((4, 4))
    F[:3, :3] = across @ R
    F[3, 3] = 1.0
    out = F @ x
    for i in range(3):
        out[i] -= shift[i] * x[3]
    standing = math.sqrt(shift @ shift) < least_speed_m_s * duration_s
    if not standing:
        F[:3, 3] = -shift
    moved_P = F @ P @ F.T
    # G maps a twist's error to that of ṡ; χ itself is uncertain too.
    spread = math.sqrt(out[3] * out[3] + P[3, 3])
    G = np.zeros((3, 6))
    G[0, 0] = G[1, 1] = G[2, 2] = -spread
    G[0, 4], G[0, 5] = -out[2], out[1]
    G[1, 3], G[1, 5] = out[2], -out[0]
    G[2, 3], G[2, 4] = -out[1], out[0]
    G = across @ G
    Q = G @ twist_spectrum @ G.T
    for i in range(3):
        for j in range(3):
            moved_P[i, j] += duration_s * Q[i, j]
            if standing:
                moved_P[i, j] += shift[i] * shift[j] * P[3, 3]
    return out, moved_P


@jit
def seen(
    x: FloatArray, P: FloatArray, s: FloatArray, covariance: FloatArray, axis: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """x and P after an image showed ``s`` (3,) ± ``covariance`` (3, 3), and its normalised
    innovation squared, whose expectation is 3 for a sphere and 2 for a cylinder."""
    B = _basis(axis)
    k = B.shape[1]
    noise = B.T @ covariance @ B
    finest = _FINEST * _FINEST * (s @ s)
    for i in range(k):
        noise[i, i] += finest
    H = np.zeros((k, 4))
    H[:, :3] = B.T
    innovation = B.T @ (s - x[:3])
    PH = P @ H.T
    inverse = np.linalg.inv(H @ PH + noise)
    gain = PH @ inverse
    nis = float(innovation @ (inverse @ innovation))
    left = np.eye(4) - gain @ H
    seen_P = left @ P @ left.T + gain @ noise @ gain.T
    return x + gain @ innovation, 0.5 * (seen_P + seen_P.T), nis


@jit_template
def _basis(axis: FloatArray) -> FloatArray:
    """Unit vectors (3, k) that span where s may lie: all of space, or what is across the axis."""
    if axis @ axis < 0.5:
        return np.eye(3)
    least = 0
    for i in range(1, 3):
        if abs(axis[i]) < abs(axis[least]):
            least = i
    first = -axis[least] * axis
    first[least] += 1.0
    first /= math.sqrt(first @ first)
    B = np.empty((3, 2))
    B[:, 0] = first
    B[0, 1] = axis[1] * first[2] - axis[2] * first[1]
    B[1, 1] = axis[2] * first[0] - axis[0] * first[2]
    B[2, 1] = axis[0] * first[1] - axis[1] * first[0]
    return B
