"""Where the camera starts: from the target's place and the configured view of it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sim_backend.board import Board
from sim_backend.config_targets import StartPose
from sim_backend.lens import Lens
from sim_backend.scene import Cylinder, Sphere, middle_m

FloatArray = NDArray[np.float64]

_DOWN = np.diag([1.0, -1.0, -1.0])


def start_pose(target: Sphere | Cylinder | Board, start: StartPose, lens: Lens) -> FloatArray:
    """T_base_camera (4, 4) from which the target appears as ``start`` describes."""
    straight = target.T_base_board[:3, :3] if isinstance(target, Board) else _DOWN
    # About the axes of base as they lie below a camera that looks down: its x and its -y.
    tilt = Rotation.from_euler("XY", [start.tilt_x_deg, -start.tilt_y_deg], degrees=True)
    spin = Rotation.from_euler("Z", start.spin_deg, degrees=True)
    R = straight @ (tilt * spin).as_matrix()
    focal_px = np.array([lens.fx_px, lens.fy_px])
    ray = np.array([*(np.array(start.offset_px) / focal_px), 1.0])
    T = np.eye(4)
    T[:3, :3] = R
    T[:3, 3] = middle_m(target) - R @ (start.distance_m * ray / np.linalg.norm(ray))
    return T
