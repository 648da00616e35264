"""Twists of rigidly joined bodies: the camera is bolted to the tool."""

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState

FloatArray = NDArray[np.float64]


def twist_map(T_a_b: FloatArray) -> FloatArray:
    """The 6x6 matrix that turns b's twist (b axes) into a's twist (a axes) for joined bodies.

    ``T_a_b`` (4, 4) maps b coordinates into a. Twists are (v, ω); with R and p the rotation and
    translation of ``T_a_b``: ω_a = R ω_b and v_a = R v_b + p × (R ω_b).
    """
    R, p = T_a_b[:3, :3], T_a_b[:3, 3]
    p_cross = np.array([[0.0, -p[2], p[1]], [p[2], 0.0, -p[0]], [-p[1], p[0], 0.0]])
    out = np.zeros((6, 6))
    out[:3, :3] = R
    out[3:, 3:] = R
    out[:3, 3:] = p_cross @ R
    return out


def invert(T_a_b: FloatArray) -> FloatArray:
    """The inverse (4, 4) of a rigid transform, ``T_b_a``."""
    R, p = T_a_b[:3, :3], T_a_b[:3, 3]
    out = np.eye(4)
    out[:3, :3] = R.T
    out[:3, 3] = -R.T @ p
    return out


def uncertainty_at_camera(
    state: ArmState, camera_from_tool: FloatArray
) -> tuple[FloatArray | None, FloatArray | None]:
    """Covariance and spectral density (6, 6) of the camera's twist, None where the arm knows none.

    ``camera_from_tool`` (6, 6) maps the tool's twist to the camera's.
    """
    covariance, spectrum = (
        None if known is None else camera_from_tool @ known @ camera_from_tool.T
        for known in (state.twist_covariance, state.twist_spectrum)
    )
    return covariance, spectrum
