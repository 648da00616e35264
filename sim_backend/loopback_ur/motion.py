"""How the emulated arm moves: joint references within acceleration limits, followed by MuJoCo.

As on the real arm, Cartesian speeds become joint references through the Jacobian at the
references, undamped: next to a singularity they ask for more than the joints can do. That, a
joint at the end of its range, and an arm that does not follow are violations.

Assumed, not documented: the servos' lag, the deceleration of each kind of stop, where exactly
a violation begins, and that ``speedl`` ramps its linear and angular parts separately, each
along a straight line.
"""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv

from sim_backend.loopback_ur.arm_model import ArmModel

FloatArray = NDArray[np.float64]

STEP_S = 0.002
_AT_REST_RAD_S = 1e-6


@dataclass(frozen=True, slots=True)
class MotionConfig:
    """The arm's dynamics."""

    lag_s: float = 0.006  # of every joint's servo
    max_joint_speed_rad_s: float = math.pi  # UR5e data sheet: 180°/s
    joint_range_rad: float = 2.0 * math.pi  # UR5e data sheet: ± 360°
    max_joint_acceleration_rad_s2: float = 40.0
    max_deviation_rad: float = 0.1  # of a joint from its reference
    program_stop_rad_s2: float = 10.0  # joint deceleration when a program ends while moving
    protective_stop_rad_s2: float = 25.0


class Mode(Enum):
    """What the reference does."""

    HOLD = "hold"  # decelerate, then stand
    SPEED_TOOL = "speedl"
    SPEED_JOINT = "speedj"
    STOP_TOOL = "stopl"
    MOVE = "move"


_TOOL_MODES = (Mode.SPEED_TOOL, Mode.STOP_TOOL)


class Motion:
    """Joint positions and velocities, advanced one step of 2 ms at a time."""

    def __init__(self, config: MotionConfig, q: FloatArray, T_flange_tool: FloatArray) -> None:
        self._config = config
        self.T_flange_tool = T_flange_tool
        self._arm = ArmModel(q, T_flange_tool, config.lag_s, STEP_S)
        self.q = np.array(q, dtype=float)
        self.qd = np.zeros(6)
        self.q_target = self.q.copy()
        self.qd_target = np.zeros(6)
        self.mode = Mode.HOLD
        self.violation: str | None = None  # what was asked for that the arm cannot do
        self.speed_scaling = 1.0
        self._seen: tuple[FloatArray, FloatArray, FloatArray] | None = None
        self._seen_target: tuple[FloatArray, FloatArray, FloatArray] | None = None
        self._twist_ref = np.zeros(6)  # of the tool in base axes
        self._goal = np.zeros(6)
        self._acceleration = config.program_stop_rad_s2
        self._speed = 0.0

    def speed_tool(self, twist_base: FloatArray, acceleration: float) -> None:
        """Follow a tool twist (6,) in base axes at ``acceleration`` (m/s² and rad/s²)."""
        self._enter(Mode.SPEED_TOOL)
        self._goal, self._acceleration = np.array(twist_base, dtype=float), acceleration

    def speed_joint(self, rates: FloatArray, acceleration: float) -> None:
        """Follow joint rates (6,) in rad/s."""
        self._enter(Mode.SPEED_JOINT)
        self._goal, self._acceleration = np.array(rates, dtype=float), acceleration

    def stop_tool(self, deceleration: float) -> None:
        """Stop the tool along its direction of motion (m/s², rad/s²)."""
        self._enter(Mode.STOP_TOOL)
        self._goal, self._acceleration = np.zeros(6), deceleration

    def stop_joint(self, deceleration: float) -> None:
        """Stop all joints together (rad/s²)."""
        self._enter(Mode.HOLD)
        self._acceleration = deceleration

    def move(self, q_goal: FloatArray, speed: float, acceleration: float) -> None:
        """Go to joint positions (6,), the leading joint at ``speed`` rad/s at most."""
        self._enter(Mode.MOVE)
        self._goal, self._speed, self._acceleration = np.array(q_goal), speed, acceleration

    def set_tool(self, T_flange_tool: FloatArray) -> None:
        """Take another tool centre point, as a person at the pendant may choose one."""
        self.T_flange_tool = T_flange_tool
        self._arm.set_tool(T_flange_tool)
        self._seen = self._seen_target = None

    @property
    def at_rest(self) -> bool:
        """Whether references and joints stand still."""
        return not self.qd_target.any() and _greatest(self.qd) < 1e-4

    @property
    def arrived(self) -> bool:
        """Whether a ``move`` reached its goal."""
        return self.mode is Mode.MOVE and _greatest(self._goal - self.q_target) < 1e-9

    def actual(self) -> tuple[FloatArray, FloatArray]:
        """T_base_tool (4, 4) and the Jacobian (6, 6) where the arm is."""
        if self._seen is None or self._seen[0] is not self.q:
            self._seen = (self.q, *self._arm.pose_and_jacobian(self.q))
        return self._seen[1:]

    def target(self) -> tuple[FloatArray, FloatArray]:
        """T_base_tool (4, 4) and the Jacobian (6, 6) of the references."""
        if self._seen_target is None or self._seen_target[0] is not self.q_target:
            self._seen_target = (self.q_target, *self._arm.pose_and_jacobian(self.q_target))
        return self._seen_target[1:]

    def twist_base(self) -> FloatArray:
        """The tool's true twist (6,) in base axes."""
        twist: FloatArray = self.actual()[1] @ self.qd
        return twist

    def step(self) -> None:
        """Advance by 2 ms."""
        config = self._config
        wanted = self._wanted_rates()
        self.violation = None
        if _greatest(wanted) > config.max_joint_speed_rad_s:
            self.violation = "a joint would have to go faster than it can"
            wanted = self.qd_target
        change = wanted - self.qd_target
        most = config.max_joint_acceleration_rad_s2 * STEP_S
        self.qd_target = self.qd_target + change / max(1.0, _greatest(change) / most)
        if self._resting():
            return
        self.q_target = self.q_target + self.qd_target * STEP_S
        self.q, self.qd = self._arm.step(self.q_target)
        if not self.qd_target.any() and _greatest(self.qd) < _AT_REST_RAD_S:
            self.qd = np.zeros(6)
            self._arm.rest(self.q)
        self._look_for_violation()

    def _resting(self) -> bool:
        """Whether nothing moves and nothing is asked to: friction then holds the joints."""
        return not (self.qd_target.any() or self.qd.any())

    def _look_for_violation(self) -> None:
        config = self._config
        pairs = zip(self.q_target.tolist(), self.qd_target.tolist(), strict=True)
        for joint, (q, qd) in enumerate(pairs):
            # Where the joint would come to rest if it were stopped in the next step.
            rest_rad = q + qd * STEP_S + 0.5 * qd * abs(qd) / config.protective_stop_rad_s2
            if rest_rad * math.copysign(1.0, qd) > config.joint_range_rad and qd != 0.0:
                self.violation = f"joint {joint} comes to the end of its range"
        if _greatest(self.q_target - self.q) > config.max_deviation_rad:
            self.violation = "the arm does not follow its path"

    def _enter(self, mode: Mode) -> None:
        if mode in _TOOL_MODES and self.mode not in _TOOL_MODES:
            self._twist_ref = self.target()[1] @ self.qd_target
        self.mode = mode

    def _wanted_rates(self) -> FloatArray:
        a = self._acceleration
        if self.mode in _TOOL_MODES:
            goal = self._goal * self.speed_scaling
            self._twist_ref[:3] = _towards(self._twist_ref[:3], goal[:3], a * STEP_S)
            self._twist_ref[3:] = _towards(self._twist_ref[3:], goal[3:], a * STEP_S)
            if not self._twist_ref.any():
                return np.zeros(6)
            return _rates(self.target()[1], self._twist_ref)
        if self.mode is Mode.SPEED_JOINT:
            return _towards(self.qd_target, self._goal * self.speed_scaling, a * STEP_S)
        if self.mode is Mode.MOVE:
            return self._move_rates()
        return _towards(self.qd_target, np.zeros(6), a * STEP_S)

    def _move_rates(self) -> FloatArray:
        """The leading joint's trapezoid, the others in proportion; ends exactly on the goal."""
        rest = self._goal - self.q_target
        distance = _greatest(rest)
        if distance < 1e-9:
            return np.zeros(6)
        present = _greatest(self.qd_target)
        brake = math.sqrt(2.0 * self._acceleration * distance)
        speed = min(self._speed, brake, present + self._acceleration * STEP_S, distance / STEP_S)
        rates: FloatArray = rest / distance * speed
        return rates


def _rates(J: FloatArray, twist_base: FloatArray) -> FloatArray:
    """Joint rates (6,) for a tool twist (6,); more than any joint can do in a singularity."""
    _, _, rates, singular = dgesv(J, twist_base)
    return np.full(6, math.inf) if singular else rates


def _greatest(values: FloatArray) -> float:
    """The greatest magnitude; for six numbers a tenth of the cost of NumPy's."""
    return float(max(map(abs, values.tolist())))


def _towards(present: FloatArray, goal: FloatArray, step: float) -> FloatArray:
    """``present`` moved straight towards ``goal`` by ``step`` at most."""
    rest = goal - present
    distance = math.sqrt(float(rest @ rest))
    return goal.copy() if distance <= step else present + rest * (step / distance)
