"""How the camera moved between two instants, from its measured twist: a rotation and a shift."""

import math

import numpy as np
from numpy.typing import NDArray

from estimator.jit import jit, jit_template

FloatArray = NDArray[np.float64]

# Pieces this short, each turned about its mean ω, err by 1e-9 at any speed of an arm.
_PIECE_S = 4e-3
# No arm turns a camera as fast: such a twist is a fault of what reported it.
_FASTEST_RAD_S = 100.0


def displacement(times_s: FloatArray, twists: FloatArray) -> tuple[FloatArray, FloatArray]:
    """R (3, 3) and d (3,) of a motion with twist (n, 6), linear between ``times_s`` (n,).

    R maps the camera's axes at the start into those at the end, d is the way of its centre, in
    the axes at the end: a fixed point X is seen at R X − d afterwards. For both targets that is
    (12) and (20) integrated: s = R s0 − (I − a aᵀ) d χ. Raises ArithmeticError where the twist
    is faster than any arm.
    """
    R, d = _displacement(times_s, twists)
    if not math.isfinite(d[0]):
        raise ArithmeticError(
            f"the motion cannot be followed over {times_s[-1] - times_s[0]:.3f} s: "
            "the measured twist is implausibly fast"
        )
    return R, d


@jit
def _displacement(times_s: FloatArray, twists: FloatArray) -> tuple[FloatArray, FloatArray]:
    R, d, half = np.eye(3), np.zeros(3), np.empty((3, 3))
    for k in range(times_s.size - 1):
        duration_s = times_s[k + 1] - times_s[k]
        pieces = max(1, math.ceil(duration_s / _PIECE_S - 1e-9))
        h = duration_s / pieces
        for piece in range(pieces):
            share = (piece + 0.5) / pieces
            u = twists[k] + share * (twists[k + 1] - twists[k])
            if not math.sqrt(u[3] * u[3] + u[4] * u[4] + u[5] * u[5]) <= _FASTEST_RAD_S:
                return R, np.full(3, np.nan)
            # The world turns by −ω; the shift of the piece happens in its middle.
            _turn(half, -0.5 * h * u[3], -0.5 * h * u[4], -0.5 * h * u[5])
            d = half @ (half @ d + h * u[:3])
            R = half @ (half @ R)
    return R, d


@jit_template
def _turn(out: FloatArray, x: float, y: float, z: float) -> None:
    """The rotation by the vector (x, y, z) in rad into ``out`` (3, 3): Rodrigues' formula."""
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < 1e-4:
        a, b = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    out[0, 0] = 1.0 - b * (y * y + z * z)
    out[1, 1] = 1.0 - b * (x * x + z * z)
    out[2, 2] = 1.0 - b * (x * x + y * y)
    out[0, 1], out[1, 0] = b * x * y - a * z, b * x * y + a * z
    out[0, 2], out[2, 0] = b * x * z + a * y, b * x * z - a * y
    out[1, 2], out[2, 1] = b * y * z - a * x, b * y * z + a * x
