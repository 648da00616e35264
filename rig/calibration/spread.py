"""The calibration's deviations as one covariance, correlations included.

A principal point that is off by a pixel is made up for by a camera turned by a pixel: taken
apart, both look far less certain than what a run does with them.
"""

import numpy as np
from numpy.typing import NDArray

from rig.calibration.projection import COUNT
from rig.calibration.result import CalibrationFile

FloatArray = NDArray[np.float64]

# Positions in a step: the camera in its own axes (m, rad), the intrinsics (px and coefficients),
# by how much the images' stamps are late (s).
CAMERA = slice(0, 6)
INTRINSICS = slice(6, 6 + COUNT)
LATENCY = 6 + COUNT
UNKNOWNS = LATENCY + 1


def covariance_of(file: CalibrationFile) -> FloatArray | None:
    """Covariance (16, 16) of a step of the calibrated values; None where the file has none."""
    hand_eye, latency = file.hand_eye, file.latency
    if hand_eye is None or latency is None or hand_eye.covariance is None:
        return None
    out = np.zeros((UNKNOWNS, UNKNOWNS))
    out[:LATENCY, :LATENCY] = np.array(hand_eye.covariance)
    out[LATENCY, LATENCY] = latency.std_s**2
    return out
