"""Where the camera really was, from the world's recorded joint motion."""

import numpy as np
from numpy.typing import NDArray

from sim_backend.kinematics import tool_pose, tool_twist
from sim_backend.world import World

FloatArray = NDArray[np.float64]


class CameraMotion:
    """The true motion of the camera mounted on the gantry's tool."""

    def __init__(self, world: World, T_tool_camera: FloatArray) -> None:
        self._world = world
        self._T_tool_camera = T_tool_camera

    def T_base_camera(self, t_s: float) -> FloatArray:
        """Pose (4, 4) at ``t_s``; raises ValueError outside the recorded motion."""
        pose: FloatArray = tool_pose(self._world.history.at(t_s)[0]) @ self._T_tool_camera
        return pose

    def twist_camera(self, t_s: float) -> FloatArray:
        """Twist (6,) of the camera in its own axes at ``t_s``."""
        twist = tool_twist(*self._world.history.at(t_s))
        R, p = self._T_tool_camera[:3, :3], self._T_tool_camera[:3, 3]
        v, w = twist[:3], twist[3:]
        return np.concatenate([R.T @ (v + np.cross(w, p)), R.T @ w])
