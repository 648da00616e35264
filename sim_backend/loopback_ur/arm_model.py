"""The UR5e in MuJoCo, generated from its published Denavit-Hartenberg parameters.

Published as well: the links' masses and centres of mass, and the joints' greatest torques.
Assumed: the links' inertias (rods and balls of the published masses), the rotors' inertias as
seen at the joints, and position servos that lag behind their reference by a constant time.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sim_backend.loopback_ur.kinematics import A_M, ALPHA_RAD, D_M
from sim_backend.mujoco_import import load_mujoco

FloatArray = NDArray[np.float64]

MASS_KG = (3.761, 8.058, 2.846, 1.37, 1.3, 0.365)
# Centres of mass in the links' own Denavit-Hartenberg frames.
_CENTRE_M = (
    (0.0, -0.02561, 0.00193),
    (0.2125, 0.0, 0.11336),
    (0.15, 0.0, 0.0265),
    (0.0, -0.0018, 0.01634),
    (0.0, 0.0018, 0.01634),
    (0.0, 0.0, -0.001159),
)
MAX_TORQUE_N_M = (150.0, 150.0, 150.0, 28.0, 28.0, 28.0)
_LINK_RADIUS_M = (0.06, 0.06, 0.05, 0.04, 0.04, 0.035)
_ROTOR_KG_M2 = (0.4, 0.4, 0.4, 0.05, 0.05, 0.05)
# No less than a joint ever has to turn, the stretched arm behind it: the servos are set for it.
_GREATEST_KG_M2 = (8.0, 8.0, 3.5, 0.4, 0.2, 0.1)


def mjcf(lag_s: float, step_s: float, T_flange_tool: FloatArray) -> str:
    """The model: six hinges with servos, and the site ``tool``; no shapes, nothing to touch.

    The servos are critically damped or slower for every pose, so they do not overshoot, and at
    constant speed they stay ``lag_s`` behind. Their torque, gravity's share included, is limited.
    """
    bodies, servos, place = "", "", 'pos="0 0 0"'
    for i in range(6):
        most = MAX_TORQUE_N_M[i]
        bodies += (
            f'<body {place} gravcomp="1">{_inertial(i)}<joint name="{i}" axis="0 0 1" '
            f'armature="{_ROTOR_KG_M2[i]}" actuatorgravcomp="true" '
            f'actuatorfrcrange="{-most} {most}"/>'
        )
        stiffness = 4.0 * _GREATEST_KG_M2[i] / lag_s**2
        servos += f'<position joint="{i}" kp="{stiffness}" kv="{stiffness * lag_s}"/>'
        half = ALPHA_RAD[i] / 2.0
        place = f'pos="{A_M[i]} 0 {D_M[i]}" quat="{math.cos(half)} {math.sin(half)} 0 0"'
    turn = _words(_quaternion(T_flange_tool))
    tool = f'<site name="tool" pos="{_words(T_flange_tool[:3, 3])}" quat="{turn}"/>'
    bodies += f"<body {place}>{tool}</body>" + "</body>" * 6
    option = f'<option timestep="{step_s}" integrator="implicitfast"/>'
    compiler = '<compiler angle="radian" autolimits="true"/>'
    return (
        f'<mujoco model="ur5e">{compiler}{option}<worldbody>{bodies}</worldbody>'
        f"<actuator>{servos}</actuator></mujoco>"
    )


class ArmModel:
    """The arm's dynamics, one step after another, and its kinematics at any joint positions."""

    def __init__(
        self, q: FloatArray, T_flange_tool: FloatArray, lag_s: float, step_s: float
    ) -> None:
        if lag_s < step_s:
            raise ValueError(f"a lag of {lag_s:g} s is shorter than the step of {step_s:g} s")
        self._mujoco: Any = load_mujoco()
        self._model = self._mujoco.MjModel.from_xml_string(mjcf(lag_s, step_s, T_flange_tool))
        self._data = self._mujoco.MjData(self._model)
        self._data.qpos[:] = q
        self._half_step_s = 0.5 * step_s
        self._looking = self._mujoco.MjData(self._model)

    def step(self, q_target: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint positions and velocities (6,) each after one step towards ``q_target`` (6,).

        MuJoCo moves the position by the step's final velocity, so the two belong together half
        a step earlier: the arm is thought to be there half a step later.
        """
        data = self._data
        data.ctrl[:] = q_target
        self._mujoco.mj_step(self._model, data)
        qd = data.qvel.copy()
        return data.qpos - self._half_step_s * qd, qd

    def rest(self, q: FloatArray) -> None:
        """Stand still at ``q`` (6,), as the friction of real joints makes them."""
        self._data.qpos[:] = q
        self._data.qvel[:] = 0.0

    def set_tool(self, T_flange_tool: FloatArray) -> None:
        """Move the site ``tool``."""
        self._model.site_sameframe[0] = 0  # else a site that began at the flange stays there
        self._model.site_pos[0] = T_flange_tool[:3, 3]
        self._model.site_quat[0] = _quaternion(T_flange_tool)

    def pose_and_jacobian(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """T_base_tool (4, 4) and J (6, 6): joint rates → (v, ω) of the tool in base axes."""
        mujoco, model, data = self._mujoco, self._model, self._looking
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        J = np.empty((6, 6))
        mujoco.mj_jacSite(model, data, J[:3], J[3:], 0)
        T = np.eye(4)
        T[:3, :3] = data.site_xmat[0].reshape(3, 3)
        T[:3, 3] = data.site_xpos[0]
        return T, J


def _inertial(i: int) -> str:
    """The mass of link ``i``: a rod along its frame's x as long as the link, or a ball."""
    half = ALPHA_RAD[i] / 2.0
    R = Rotation.from_rotvec([ALPHA_RAD[i], 0.0, 0.0]).as_matrix()
    centre_m = np.array([A_M[i], 0.0, D_M[i]]) + R @ np.array(_CENTRE_M[i])
    mass, length_m, radius_m = MASS_KG[i], abs(A_M[i]), _LINK_RADIUS_M[i]
    if length_m == 0.0:
        along = across = 0.4 * mass * radius_m**2
    else:
        along = 0.5 * mass * radius_m**2
        across = mass * (3.0 * radius_m**2 + length_m**2) / 12.0
    return (
        f'<inertial pos="{_words(centre_m)}" quat="{math.cos(half)} {math.sin(half)} 0 0" '
        f'mass="{mass}" diaginertia="{along} {across} {across}"/>'
    )


def _quaternion(T: FloatArray) -> FloatArray:
    """(w, x, y, z) of a transform's rotation."""
    return Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True)


def _words(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)
