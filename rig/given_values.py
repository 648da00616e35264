"""The geometry in a configuration, as the estimator takes it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig

FloatArray = NDArray[np.float64]


def intrinsics_of(config: RigConfig) -> Intrinsics | None:
    """The given calibration's intrinsics."""
    given = config.calibration.intrinsics
    if given is None:
        return None
    return Intrinsics(
        given.fx_px, given.fy_px, given.cx_px, given.cy_px, np.array(given.distortion)
    )


def hand_eye_of(config: RigConfig) -> FloatArray | None:
    """The given calibration's T_tool_camera (4, 4)."""
    given = config.calibration
    if given.tool_camera_xyz_m is None or given.tool_camera_rotvec_rad is None:
        return None
    T_tool_camera = np.eye(4)
    T_tool_camera[:3, :3] = Rotation.from_rotvec(given.tool_camera_rotvec_rad).as_matrix()
    T_tool_camera[:3, 3] = given.tool_camera_xyz_m
    return T_tool_camera
