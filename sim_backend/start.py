"""Where the camera starts: from the target's place and the configured view of it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sim_backend.config import StartPose
from sim_backend.lens import Lens
from sim_backend.scene import Cylinder, Sphere

FloatArray = NDArray[np.float64]


def start_pose(target: Sphere | Cylinder, start: StartPose, lens: Lens) -> FloatArray:
    """T_base_camera (4, 4) from which the target appears as ``start`` describes."""
    tilt = Rotation.from_euler("XY", [start.tilt_x_deg, start.tilt_y_deg], degrees=True)
    down = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
    spin = Rotation.from_euler("Z", start.spin_deg, degrees=True)
    R = (tilt * down * spin).as_matrix()
    ray = np.array([*(np.array(start.offset_px) / lens.focal_px), 1.0])
    centre = target.centre_m if isinstance(target, Sphere) else target.middle_m
    T = np.eye(4)
    T[:3, :3] = R
    T[:3, 3] = centre - R @ (start.distance_m * ray / np.linalg.norm(ray))
    return T
