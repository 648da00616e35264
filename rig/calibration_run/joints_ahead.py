"""Which joints an arm would have at a pose, from its drawings: nothing is connected."""

from itertools import product
from math import atan2, pi

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drivers.interfaces import Joints
from drivers.ur.kinematics import MODELS, Kinematics
from rig.config import RigConfig
from rig.config_devices import SimArm, UrArm
from sim_backend.arm import joints_at
from sim_backend.kinematics import joints_for

FloatArray = NDArray[np.float64]

_NO_TCP = (0.0,) * 6
_STEPS = 100
_LONGEST_STEP_RAD = 0.5
_DAMPING = 1e-6
_SAME = 1e-8  # m and rad
_LATER = "joints are checked when the arm is connected: a pose out of reach is passed over then"
_WHERE = "the board as it stands before the arm (sim.board.position_m, sim.board.start)"
_WEIGHTS = np.repeat([10.0, 1.0], 3)  # a singular value counts radians over 0.1 m


def joints_ahead(config: RigConfig, T_base_tool: FloatArray) -> tuple[Joints | None, str]:
    """The joints at a pose (4, 4) and whose they are, or None and why, in words.

    A UR is taken to stand with its elbow up, as far from singularities as it can there.
    """
    arm = config.arm
    if isinstance(arm, SimArm):
        return joints_at(joints_for(T_base_tool)), "the simulated gantry"
    if not isinstance(arm, UrArm):
        return None, _LATER
    if arm.model is None:
        return None, f"{_LATER}; name the arm (arm.model: {MODELS[4].name}) to check them now"
    model = next(one for one in MODELS if one.name == arm.model)
    found = ur_joints(Kinematics(model, arm.tcp_offset or _NO_TCP), T_base_tool)
    if found is None:
        return (
            None,
            f"a {arm.model} does not get to this first look with its elbow up: put {_WHERE}",
        )
    return found, f"a {arm.model}"


def ur_joints(kinematics: Kinematics, T_base_tool: FloatArray) -> Joints | None:
    """Joints of a UR with its elbow up at a pose (4, 4); None when it does not get there."""
    ahead = atan2(float(T_base_tool[1, 3]), float(T_base_tool[0, 3]))
    best: tuple[float, FloatArray] | None = None
    for base, wrist, turn in product((ahead, ahead + pi), (pi / 2, -pi / 2), (-pi / 2, pi / 2)):
        up = -1.0 if base == ahead else 1.0  # the shoulder leans to where the tool is
        start = np.array([base, -pi / 2, up * pi / 2, up * pi / 2, wrist, turn])
        q = _solved(kinematics, T_base_tool, start)
        if q is None:
            continue
        room = float(np.linalg.svd(_WEIGHTS[:, None] * kinematics.tool_jacobian(q))[1][-1])
        if best is None or room > best[0]:
            best = room, q
    return None if best is None else kinematics.joints(best[1])


def _solved(
    kinematics: Kinematics, T_base_tool: FloatArray, start: FloatArray
) -> FloatArray | None:
    """Newton's method from ``start`` (6,), by damped steps; each joint within half a turn."""
    q = start.copy()
    for _ in range(_STEPS):
        T = kinematics.tool_pose(q)
        off = T[:3, :3].T @ (T_base_tool[:3, 3] - T[:3, 3])
        turn = Rotation.from_matrix(T[:3, :3].T @ T_base_tool[:3, :3]).as_rotvec()
        error = np.concatenate([off, turn])
        if float(np.abs(error).max()) < _SAME:
            return np.asarray((q + pi) % (2.0 * pi) - pi)
        J = kinematics.tool_jacobian(q)
        step = np.linalg.solve(J.T @ J + _DAMPING * np.eye(6), J.T @ error)
        q = q + step * min(1.0, _LONGEST_STEP_RAD / max(float(np.abs(step).max()), 1e-12))
    return None
