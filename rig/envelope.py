"""What lies in the way: walls, table, target, image border, joint ends, singularities.

Each is a barrier with the room left to it and the rate at which a twist would use that room
up. The limiter slows a twist until no barrier is approached faster than allowed.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState, Joints
from estimator.estimate import Estimate
from estimator.image.intrinsics import Intrinsics
from estimator.vectors import cross
from rig.config_safety import SafetyConfig
from rig.field_of_view import border_planes, room_in_view
from rig.frames import invert, twist_map

FloatArray = NDArray[np.float64]

# Rates towards barriers that are no distances may use up this share of the room per second.
_APPROACH_PER_S = 4.0
# Turns the Jacobian's linear rows into numbers comparable with its angular ones.
_LENGTH_M = 0.1
# The scaled Jacobian of an arm of 1 m reach changes no faster than this per rad of any joint.
_STEEPEST = 1.0 / _LENGTH_M
_LOOK_AHEAD_S = 1e-3
_JOINT_DAMPING = 1e-4
_ORIGIN = np.zeros(3)
_WEIGHTS = np.repeat([1.0 / _LENGTH_M, 1.0], 3)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the barriers are computed from, at one tick."""

    state: ArmState
    target: Estimate | None = None
    joints: Joints | None = None
    image_shape: tuple[int, ...] | None = None  # (height, width)


class Barrier(NamedTuple):
    """One thing not to pass; ``room`` in m for distances, else in the barrier's own unit."""

    name: str
    room: float
    closing: float  # rate at which the twist in question uses the room up; negative: gains room
    is_distance: bool

    def allowed_closing(self, deceleration_m_s2: float, reaction_time_s: float) -> float:
        """The fastest approach that still ends before the barrier."""
        room = max(self.room, 0.0)
        if not self.is_distance:
            return _APPROACH_PER_S * room
        # Close to the barrier this is room / (2 reaction times): slow enough for no overshoot.
        late = 2.0 * deceleration_m_s2 * reaction_time_s
        return sqrt(late * late + 2.0 * deceleration_m_s2 * room) - late


class SpeedLimit(NamedTuple):
    """A joint's greatest speed: nothing to keep away from, only to be slower than."""

    name: str
    most: float  # m/s or rad/s
    closing: float  # the joint's speed under the twist in question
    room: float = inf

    def allowed_closing(self, deceleration_m_s2: float, reaction_time_s: float) -> float:
        """The greatest speed."""
        return self.most


class Envelope:
    """The configured barriers of one rig.

    Without ``T_tool_camera`` (4, 4) and ``intrinsics`` those that concern camera and target
    are left out, as for a jog.
    """

    def __init__(
        self,
        config: SafetyConfig,
        T_tool_camera: FloatArray | None = None,
        intrinsics: Intrinsics | None = None,
    ) -> None:
        self._config = config
        self._T_tool_camera = T_tool_camera
        self._camera_from_tool = None if T_tool_camera is None else twist_map(invert(T_tool_camera))
        self._intrinsics = intrinsics
        self._planes: FloatArray | None = None

    def barriers(
        self, twist_tool: FloatArray, around: Surroundings
    ) -> Iterator[Barrier | SpeedLimit]:
        """The barriers on the side ``twist_tool`` (6,) goes to, with what it would do to them."""
        yield from self._workspace(twist_tool, around.state)
        yield from self._table(twist_tool, around.state)
        if around.joints is not None:
            yield from self._joints(twist_tool, around.joints)
        if around.target is not None and self._camera_from_tool is not None:
            twist_camera = self._camera_from_tool @ twist_tool
            yield from self._target(twist_camera, around.target)
            yield from self._view(twist_camera, around.target, around.image_shape)

    def table_room_m(self, state: ArmState) -> float:
        """Distance of tool and camera from the table's plane beyond the minimum; inf: no table."""
        return min((b.room for b in self._table(np.zeros(6), state)), default=float("inf"))

    def _workspace(self, twist: FloatArray, state: ArmState) -> Iterator[Barrier]:
        velocity = (state.T_base_tool[:3, :3] @ twist[:3]).tolist()
        position = state.T_base_tool[:3, 3].tolist()
        low, high = self._config.workspace_min_m, self._config.workspace_max_m
        for axis, name in enumerate("xyz"):
            x, speed = position[axis], velocity[axis]
            if speed < 0.0:
                yield Barrier(f"workspace {name} min", x - low[axis], -speed, True)
            else:
                yield Barrier(f"workspace {name} max", high[axis] - x, speed, True)

    def _table(self, twist: FloatArray, state: ArmState) -> Iterator[Barrier]:
        table = self._config.table
        if table is None:
            return
        R, normal = state.T_base_tool[:3, :3], np.array(table.normal)
        arms = [("tool", _ORIGIN)]
        if self._T_tool_camera is not None:
            arms.append(("camera", self._T_tool_camera[:3, 3]))
        for name, arm in arms:
            height = float(normal @ (state.T_base_tool[:3, 3] + R @ arm)) - table.offset_m
            velocity = R @ (twist[:3] + cross(twist[3:], arm))
            yield Barrier(
                f"table ({name})", height - table.min_distance_m, -float(normal @ velocity), True
            )

    def _target(self, twist_camera: FloatArray, target: Estimate) -> Iterator[Barrier]:
        """The target's surface; unknown, so absent, while the estimate has no positive radius."""
        if not target.chi > 0.0:
            return
        norm = float(np.linalg.norm(target.s))
        room = (norm - 1.0) / target.chi - self._config.min_target_distance_m
        yield Barrier("target distance", room, float(twist_camera[:3] @ target.s) / norm, True)

    def _view(
        self, twist_camera: FloatArray, target: Estimate, shape: tuple[int, ...] | None
    ) -> Iterator[Barrier]:
        if self._intrinsics is None or shape is None:
            return
        if self._planes is None:
            margin = self._config.field_of_view_margin_px
            self._planes = border_planes(self._intrinsics, shape, margin)
        before = room_in_view(target.s, target.axis, self._planes)
        fastest = np.linalg.norm(twist_camera[3:]) + np.linalg.norm(twist_camera[:3] * target.chi)
        if fastest < _APPROACH_PER_S * before.min():
            return  # no direction of motion could close in too fast
        moved = _moved(target, twist_camera, _LOOK_AHEAD_S)
        after = room_in_view(*moved, self._planes)
        for k, side in enumerate(("left", "right", "top", "bottom")):
            closing = (before[k] - after[k]) / _LOOK_AHEAD_S
            yield Barrier(f"field of view {side}", float(before[k]), float(closing), False)

    def _joints(self, twist: FloatArray, joints: Joints) -> Iterator[Barrier | SpeedLimit]:
        config, J = self._config, joints.jacobian(joints.q)
        scaled = _WEIGHTS[:, None] * J
        normal = scaled.T @ scaled
        normal.flat[:: len(normal) + 1] += _JOINT_DAMPING
        qd = np.linalg.solve(normal, scaled.T @ (_WEIGHTS * twist))
        to_low, to_high = (joints.q - joints.low).tolist(), (joints.high - joints.q).tolist()
        for k, (name, rate) in enumerate(zip(joints.names, qd.tolist(), strict=True)):
            margin = config.joint_margin_m if joints.linear[k] else config.joint_margin_rad
            if rate < 0.0:
                yield Barrier(f"joint {name} min", to_low[k] - margin, -rate, False)
            else:
                yield Barrier(f"joint {name} max", to_high[k] - margin, rate, False)
            if joints.fastest is not None:
                most = config.joint_speed_share * float(joints.fastest[k])
                yield SpeedLimit(f"joint {name} speed", most, abs(rate))
        room = _smallest_singular_value(scaled) - config.min_singular_value
        fastest = float(np.abs(qd).max())
        if _STEEPEST * fastest < _APPROACH_PER_S * room:
            return  # far away, whatever the joints do
        # A step short enough for the singular value to be linear, whatever the joint speed.
        step_s = min(_LOOK_AHEAD_S, 1e-3 / max(fastest, 1e-9))
        then = _smallest_singular_value(_WEIGHTS[:, None] * joints.jacobian(joints.q + step_s * qd))
        closing = (room + config.min_singular_value - then) / step_s
        yield Barrier("singularity", room, closing, False)


def _moved(
    target: Estimate, twist_camera: FloatArray, dt_s: float
) -> tuple[FloatArray, FloatArray | None]:
    """s and the axis after ``dt_s`` of ``twist_camera``, to first order."""
    v, w, axis = twist_camera[:3], twist_camera[3:], target.axis
    across = v if axis is None else v - (axis @ v) * axis
    s = target.s - dt_s * (target.chi * across + cross(w, target.s))
    return s, None if axis is None else axis - dt_s * cross(w, axis)


def _smallest_singular_value(J: FloatArray) -> float:
    return float(np.linalg.svd(J, compute_uv=False)[-1])
