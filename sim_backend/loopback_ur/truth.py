"""Where the emulated arm really was: for cameras rendered on it, and to measure at the source."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from sim_backend.history import JointHistory
from sim_backend.loopback_ur.kinematics import pose_and_jacobian, tool_pose

FloatArray = NDArray[np.float64]


class ArmTruth:
    """The recorded joint motion of the last minutes, on the host's monotonic clock."""

    def __init__(self, history: JointHistory, T_flange_tool: FloatArray, clock: Clock) -> None:
        self.history = history
        self.T_flange_tool = T_flange_tool
        self.clock = clock

    def sync(self) -> float:
        """The newest recorded instant: a camera must not look further."""
        return min(self.clock.now_s(), self.history.time_s(self.history.count - 1))

    def T_base_tool(self, t_s: float) -> FloatArray:
        """Pose (4, 4) of the tool at ``t_s``; raises ValueError outside the recorded motion."""
        return tool_pose(self.history.at(t_s)[0], self.T_flange_tool)

    def twist_base(self, t_s: float) -> FloatArray:
        """Twist (6,) of the tool at ``t_s``, in base axes."""
        q, qd = self.history.at(t_s)
        twist: FloatArray = pose_and_jacobian(q, self.T_flange_tool)[1] @ qd
        return twist


class TrueMotion(Protocol):
    """The tool's true motion on the host's monotonic clock."""

    def T_base_tool(self, t_s: float) -> FloatArray:
        """Pose (4, 4) of the tool at ``t_s``."""
        ...

    def twist_base(self, t_s: float) -> FloatArray:
        """Twist (6,) of the tool at ``t_s``, in base axes."""
        ...


class ArmCameraMotion:
    """The true motion of a camera bolted to the emulated arm's tool."""

    def __init__(self, truth: TrueMotion, T_tool_camera: FloatArray) -> None:
        self._truth = truth
        self._T_tool_camera = T_tool_camera

    def T_base_camera(self, t_s: float) -> FloatArray:
        """Pose (4, 4) at ``t_s``; raises ValueError outside the recorded motion."""
        pose: FloatArray = self._truth.T_base_tool(t_s) @ self._T_tool_camera
        return pose

    def twist_camera(self, t_s: float) -> FloatArray:
        """Twist (6,) of the camera in its own axes at ``t_s``."""
        twist = self._truth.twist_base(t_s)
        T_base_tool = self._truth.T_base_tool(t_s)
        arm_m = T_base_tool[:3, :3] @ self._T_tool_camera[:3, 3]
        R = (T_base_tool @ self._T_tool_camera)[:3, :3]
        return np.concatenate([R.T @ (twist[:3] + np.cross(twist[3:], arm_m)), R.T @ twist[3:]])
