"""Which way to move so that the radius becomes known soonest: the value of a displacement."""

import math

import numpy as np
from numpy.typing import NDArray

from estimator.active.sigma2 import useful_velocity
from estimator.vectors import cross

FloatArray = NDArray[np.float64]

# Added to the images' covariance, as a share of s: keeps what is inverted regular.
_LEAST_SHARE = 1e-9
# Directions across a line of sight, and the share of s beside the optical axis that counts.
_AROUND, _ASIDE = 16, 1e-6


def variance_decrease(
    covariance: FloatArray, image_covariance: FloatArray, shifts: FloatArray
) -> FloatArray:
    """By how much var(χ) falls (n,) when an image follows each of ``shifts`` (n, 3).

    ``covariance`` (4, 4) is that of (s, χ) now, ``image_covariance`` (3, 3) that of the s which
    the image then shows, ``shifts`` the useful parts of the camera's displacement in m, in its
    own axes now. One step of the Kalman filter: with s' = s − d χ, c = cov(s', χ) and S the
    covariance of the innovation, the decrease is cᵀ S⁻¹ c.
    """
    P_ss, P_sx, P_xx = covariance[:3, :3], covariance[:3, 3], float(covariance[3, 3])
    c = P_sx - P_xx * shifts
    crossed = shifts[:, :, None] * P_sx
    S = P_ss - crossed - crossed.swapaxes(1, 2) + P_xx * shifts[:, :, None] * shifts[:, None, :]
    S = S + image_covariance
    S = S + _LEAST_SHARE * np.trace(S, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    decrease: FloatArray = np.einsum("ni,ni->n", c, np.linalg.solve(S, c[:, :, None])[:, :, 0])
    return decrease


def displacements(directions: FloatArray, distance_m: float, axis: FloatArray | None) -> FloatArray:
    """The useful displacements (n, 3) of travelling ``distance_m`` along each unit direction."""
    shifts: FloatArray = useful_velocity(distance_m * directions, axis)
    return shifts


def directions_across(s: FloatArray, axis: FloatArray | None) -> FloatArray:
    """Unit vectors (n, 3) across the line of sight to s, and across a cylinder's axis too.

    Without an axis they are all around, two of them across the optical axis.
    """
    if axis is None:
        axis = np.eye(3)[2 if math.hypot(s[0], s[1]) > _ASIDE * abs(s[2]) else 0]
        steps = np.arange(_AROUND) * (2.0 * math.pi / _AROUND)
    else:
        steps = np.array([0.0, math.pi])
    first = cross(s, axis)
    first = first / math.sqrt(float(first @ first))
    second = cross(s, first) / math.sqrt(float(s @ s))
    around: FloatArray = np.cos(steps)[:, None] * first + np.sin(steps)[:, None] * second
    return around


def sphere_directions(count: int) -> FloatArray:
    """Unit vectors (count, 3) spread evenly in all directions (Fibonacci's lattice)."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    r = np.sqrt(1.0 - z * z)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
