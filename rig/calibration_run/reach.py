"""Whether the arm gets to a pose on a straight way, worked out before anything moves."""

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState, Joints
from rig.calibration import se3
from rig.config_safety import SafetyConfig
from rig.envelope import Envelope, Surroundings

FloatArray = NDArray[np.float64]

_STEP_M, _STEP_RAD = 0.02, 0.06
_STEP_JOINT = 0.06  # m or rad: or else a singularity may lie between two steps
_MOST_STEPS = 1e4
_DAMPING = 1e-6
_LENGTH_M = 0.1  # weighs metres against radians
_LACKING = 0.05  # share of a motion that the joints do not make: they cannot
_WEIGHTS = np.repeat([1.0 / _LENGTH_M, 1.0], 3)
# Ways are planned this many times as far from joint ends and singularities as the arm may come:
# next to them it would crawl, and where it is off its way it would not get by.
_EASE = 2.0


@dataclass(frozen=True, slots=True)
class Way:
    """A straight way as foreseen."""

    blocked_by: str  # the first thing in the way, or ""
    duration_s: float  # at full speed, as far as the way is free
    T_base_tool: FloatArray  # (4, 4) at its end
    joints: Joints | None  # at its end


class Reach:
    """Follows the joints along straight ways that begin at ``state``.

    Only the Jacobian is needed: poses and joints are integrated together. ``joints`` is None
    for an arm that does not know them; then only walls and table count. With ``T_tool_camera``
    (4, 4) the camera is kept off the table too.
    """

    def __init__(
        self,
        safety: SafetyConfig,
        state: ArmState,
        joints: Joints | None,
        T_tool_camera: FloatArray | None = None,
    ) -> None:
        eased = {
            name: _EASE * getattr(safety, name)
            for name in ("joint_margin_rad", "joint_margin_m", "min_singular_value")
        }
        self._safety = safety
        self._envelope = Envelope(safety.model_copy(update=eased), T_tool_camera)
        self._state = state
        self._joints = joints

    def after(self, way: Way) -> "Reach":
        """What can be reached from where a way ends."""
        other = copy(self)
        other._state = replace(self._state, T_base_tool=way.T_base_tool)
        other._joints = way.joints
        return other

    def blocked_by(self, T_base_tool: FloatArray) -> str:
        """The first thing in the way to a pose (4, 4), or ""."""
        return self.way(T_base_tool).blocked_by

    def way(self, T_base_tool: FloatArray) -> Way:
        """The straight way to a pose (4, 4)."""
        start, joints = self._state.T_base_tool, self._joints
        way = se3.log(se3.inverse(start) @ T_base_tool)
        T, done, duration_s = start, 0.0, 0.0
        while done < 1.0:
            share = min(self._share(joints, way), 1.0 - done)
            qd = None
            if joints is not None:
                qd, lacking = _joint_step(joints, share * way)
                if lacking > _LACKING:
                    return Way("the arm has no joints for this motion", duration_s, T, joints)
                joints = replace(joints, q=joints.q + qd)
            done = 1.0 if done + share > 1.0 - 1e-9 else done + share
            T = start @ se3.exp(done * way)
            name = self._breached(T, share * way, joints)
            if name:
                return Way(name, duration_s, T, joints)
            duration_s += self._least_s(share * way, qd)
        return Way("", duration_s, T_base_tool, joints)

    def _share(self, joints: Joints | None, way: FloatArray) -> float:
        """The share of a way (6,) that neither the tool nor a joint goes farther than a step in."""
        steps = max(_length(way[:3]) / _STEP_M, _length(way[3:]) / _STEP_RAD, 1.0)
        if joints is not None:
            qd = _solved(joints.jacobian(joints.q), way)
            steps = max(steps, float(np.abs(qd).max()) / _STEP_JOINT)
        return 1.0 / min(steps, _MOST_STEPS)

    def _least_s(self, step: FloatArray, qd: FloatArray | None) -> float:
        """The least time that tool and joints take for a step (6,) by the joints ``qd`` (n,)."""
        safety = self._safety
        turn_s = _length(step[3:]) / safety.max_angular_speed_rad_s
        least_s = max(_length(step[:3]) / safety.max_linear_speed_m_s, turn_s)
        if self._joints is None or qd is None or self._joints.fastest is None:
            return least_s
        fastest = safety.joint_speed_share * self._joints.fastest
        return max(least_s, float(np.max(np.abs(qd) / fastest)))

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


def _length(vector: FloatArray) -> float:
    return float(np.linalg.norm(vector))
