"""Whether the arm's poses can determine a hand-eye transform, and which motion is missing."""

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration.errors import CalibrationError, ScaleError
from rig.calibration.hand_eye_model import Noise

FloatArray = NDArray[np.float64]

_MIN_TURN_RAD = np.radians(3.0)  # rms about each of two axes
_SCALE_SIGMAS = 4.0
_WORST_ARM_M, _WORST_ARM_RAD = 5e-3, np.radians(2.0)


def check_rotations(T_base_tool: FloatArray) -> None:
    """Raise CalibrationError unless the poses (m, 4, 4) turn about two different axes.

    Turning about one axis alone leaves the camera's place along it unknown; pure translations
    leave all of it unknown.
    """
    R = T_base_tool[:, :3, :3]
    turns = se3.rotation_vectors(np.swapaxes(se3.mean_rotation(R), 0, 1) @ R)  # tool axes
    _, strength, axes = np.linalg.svd(turns - turns.mean(axis=0), full_matrices=False)
    rms = strength / np.sqrt(len(R))
    degrees = np.degrees(rms)
    if rms[0] < _MIN_TURN_RAD:
        raise CalibrationError(
            f"the tool hardly turns between the poses ({degrees[0]:.1f}° rms): turn it by 10° or "
            "more to both sides about two different axes, for example its x and its y"
        )
    if rms[1] < _MIN_TURN_RAD:
        raise CalibrationError(
            f"all poses turn about nearly the same axis, {_named(axes[0])} of the tool (about "
            f"every other axis {degrees[1]:.1f}° rms): the camera's place along it stays unknown. "
            f"Add poses turned by 10° or more to both sides about {_named(axes[1])} of the tool"
        )


def check_scale(scale: float, std: float, square_m: float, tolerance: float) -> None:
    """Raise ScaleError when the arm's motion contradicts the size of the board."""
    off = abs(scale - 1.0)
    if off > tolerance and off > _SCALE_SIGMAS * std:
        raise ScaleError(
            f"the arm's motion contradicts the board's size by the ratio {scale:.4f} ± {std:.4f}: "
            f"a square would measure {1e3 * scale * square_m:.2f} mm, the board's definition says "
            f"{1e3 * square_m:.2f} mm. Measure the print and correct the definition; if the print "
            "is right, the arm's units (steps per mm) are not"
        )


def check_noise(noise: Noise) -> None:
    """Raise CalibrationError when arm and images disagree by more than any arm errs."""
    if noise.arm_m > _WORST_ARM_M or noise.arm_rad > _WORST_ARM_RAD:
        raise CalibrationError(
            f"arm and images contradict each other by {1e3 * noise.arm_m:.1f} mm and "
            f"{np.degrees(noise.arm_rad):.1f}° from pose to pose: is each image stored with the "
            "pose the arm had when it was taken, is T_base_tool the tool in the base and not its "
            "inverse, did the board stay where it was?"
        )


def _named(axis: FloatArray) -> str:
    """An axis in words: a letter where it is one, else its components."""
    largest = int(np.argmax(np.abs(axis)))
    if abs(axis[largest]) > np.cos(np.radians(15.0)):
        return "the " + "xyz"[largest] + " axis"
    signed = axis * np.sign(axis[largest])
    return f"the axis ({signed[0]:.2f}, {signed[1]:.2f}, {signed[2]:.2f})"
