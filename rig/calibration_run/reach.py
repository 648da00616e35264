"""Whether the arm gets to a pose on a straight way, worked out before anything moves."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState, Joints
from rig.calibration import se3
from rig.envelope import Envelope, Surroundings

FloatArray = NDArray[np.float64]

_STEP_M, _STEP_RAD = 0.02, 0.06
_DAMPING = 1e-6
_LENGTH_M = 0.1  # weighs metres against radians
_LACKING = 0.05  # share of a motion that the joints do not make: they cannot
_WEIGHTS = np.repeat([1.0 / _LENGTH_M, 1.0], 3)


class Reach:
    """Follows the joints along straight ways that begin at ``state``.

    Only the Jacobian is needed: poses and joints are integrated together. ``joints`` is None
    for an arm that does not know them; then only walls and table count.
    """

    def __init__(self, envelope: Envelope, state: ArmState, joints: Joints | None) -> None:
        self._envelope = envelope
        self._state = state
        self._joints = joints

    def __call__(self, T_base_tool: FloatArray) -> bool:
        """Whether nothing is in the way."""
        return not self.blocked_by(T_base_tool)

    def blocked_by(self, T_base_tool: FloatArray) -> str:
        """The first thing in the way to a pose (4, 4), or ""."""
        start, joints = self._state.T_base_tool, self._joints
        way = se3.log(se3.inverse(start) @ T_base_tool)
        linear, angular = float(np.linalg.norm(way[:3])), float(np.linalg.norm(way[3:]))
        steps = max(int(np.ceil(max(linear / _STEP_M, angular / _STEP_RAD))), 1)
        step = way / steps
        poses = start @ se3.exp(np.outer(np.arange(1, steps + 1), step))
        for T in poses:
            if joints is not None:
                qd, lacking = _joint_step(joints, step)
                if lacking > _LACKING:
                    return "the arm has no joints for this motion"
                joints = replace(joints, q=joints.q + qd)
            name = self._breached(T, step, joints)
            if name:
                return name
        return ""

    def _breached(self, T: FloatArray, step: FloatArray, joints: Joints | None) -> str:
        state = replace(self._state, T_base_tool=T)
        for barrier in self._envelope.barriers(step, Surroundings(state, joints=joints)):
            if barrier.room < 0.0 and barrier.closing > 0.0:
                return barrier.name
        return ""


def _joint_step(joints: Joints, step: FloatArray) -> tuple[FloatArray, float]:
    """How the joints make a small motion (6,), and the share of it that they do not make."""
    half = _solved(joints.jacobian(joints.q), step)
    J = joints.jacobian(joints.q + 0.5 * half)
    qd = _solved(J, step)
    wanted = _WEIGHTS * step
    missing = float(np.linalg.norm(wanted - _WEIGHTS * (J @ qd)))
    return qd, missing / max(float(np.linalg.norm(wanted)), 1e-12)


def _solved(J: FloatArray, step: FloatArray) -> FloatArray:
    scaled = _WEIGHTS[:, None] * J
    normal = scaled.T @ scaled + _DAMPING * np.eye(J.shape[1])
    return np.asarray(np.linalg.solve(normal, scaled.T @ (_WEIGHTS * step)))
