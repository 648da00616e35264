"""The blur's parameters (q, M1, h1, M12, M2, h2): what is likely, and their axes (compiled)."""

import numpy as np

from estimator.image.cone import outline_frame
from estimator.image.intrinsics import FloatArray
from estimator.jit import jit

# Prior of the blur parameters (q, M1, h1, M12, M2, h2): sharp to 4 px of motion are likely.
BLUR_MEAN = np.array([0.2, 0.5, 0.0, 0.0, 0.5, 0.0])
BLUR_SD = np.array([2.0, 8.0, 1.0, 8.0, 8.0, 1.0])
# Between sharp and 3 px of motion: both are reached from there in few steps.
BLUR_START = np.array([0.3, 1.5, 0.0, 0.0, 1.5, 0.0])
BLUR_START_CYLINDER = np.array([0.3, 3.0, 0.0, 0.0, 0.0, 0.0])
_WIDE_Q = 4.0  # widens the model's edge at first, so that a wrong guess is within its reach


@jit
def first_blur(s: FloatArray, a: FloatArray, geometry: int) -> tuple[FloatArray, float]:
    """The blur to start with, and the turn of its axes: a cylinder's across its lines."""
    blur = BLUR_MEAN.copy()
    blur[0] = _WIDE_Q
    if geometry == 3:
        return blur, 0.0
    blur[4] = 0.0
    b = outline_frame(s, a)[1]
    return blur, np.arctan2(b[1] * s[2] - b[2] * s[1], b[0] * s[2] - b[2] * s[0])


@jit
def diagonalised(blur: FloatArray, turn_rad: float, turning: bool) -> float:
    """Turn the blur's axes so that M12 vanishes; the new angle."""
    blur[0], blur[1], blur[4] = max(blur[0], 0.0), max(blur[1], 0.0), max(blur[4], 0.0)
    if not turning:
        return turn_rad
    by = 0.5 * np.arctan2(2.0 * blur[3], blur[1] - blur[4])
    c, sn = np.cos(by), np.sin(by)
    m1, m12, m2, h1, h2 = blur[1], blur[3], blur[4], blur[2], blur[5]
    blur[1] = max(c * c * m1 + 2.0 * c * sn * m12 + sn * sn * m2, 0.0)
    blur[4] = max(sn * sn * m1 - 2.0 * c * sn * m12 + c * c * m2, 0.0)
    blur[3] = 0.0
    blur[2], blur[5] = c * h1 + sn * h2, c * h2 - sn * h1
    return float(turn_rad + by)
