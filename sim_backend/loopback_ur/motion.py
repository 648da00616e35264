"""How the emulated arm moves: references within acceleration limits, joints that lag behind them.

Assumed, not documented: the joints' time constant, the deceleration of each kind of stop, and
that ``speedl`` ramps its linear and angular parts separately, each along a straight line.
"""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from sim_backend.loopback_ur.kinematics import joint_rates, pose_and_jacobian

FloatArray = NDArray[np.float64]

STEP_S = 0.002


@dataclass(frozen=True, slots=True)
class MotionConfig:
    """The arm's dynamics."""

    lag_s: float = 0.006  # of every joint behind its reference
    max_joint_speed_rad_s: float = math.pi  # UR5e data sheet: 180°/s
    max_joint_acceleration_rad_s2: float = 40.0
    program_stop_rad_s2: float = 10.0  # joint deceleration when a program ends while moving
    protective_stop_rad_s2: float = 25.0


class Mode(Enum):
    """What the reference does."""

    HOLD = "hold"  # decelerate, then stand
    SPEED_TOOL = "speedl"
    SPEED_JOINT = "speedj"
    STOP_TOOL = "stopl"
    MOVE = "move"


class Motion:
    """Joint positions and velocities, advanced one controller cycle at a time."""

    def __init__(self, config: MotionConfig, q: FloatArray, T_flange_tool: FloatArray) -> None:
        self._config = config
        self.q = np.array(q, dtype=float)
        self.qd = np.zeros(6)
        self.q_target = self.q.copy()
        self.qd_target = np.zeros(6)
        self.T_flange_tool = T_flange_tool
        self.T_base_tool, self.J = pose_and_jacobian(self.q, T_flange_tool)
        self.mode = Mode.HOLD
        self.overspeed = False  # a joint was asked for more than it can do
        self.speed_scaling = 1.0
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

    @property
    def at_rest(self) -> bool:
        """Whether references and joints stand still."""
        return bool(not np.any(self.qd_target) and np.abs(self.qd).max() < 1e-4)

    @property
    def arrived(self) -> bool:
        """Whether a ``move`` reached its goal."""
        return bool(self.mode is Mode.MOVE and np.abs(self._goal - self.q_target).max() < 1e-9)

    def twist_base(self) -> FloatArray:
        """The tool's true twist (6,) in base axes."""
        twist: FloatArray = self.J @ self.qd
        return twist

    def step(self) -> None:
        """Advance by one cycle of 2 ms."""
        wanted = self._wanted_rates()
        excess = float(np.abs(wanted).max()) / self._config.max_joint_speed_rad_s
        self.overspeed = excess > 1.0
        if self.overspeed:
            wanted = wanted / excess
        change = wanted - self.qd_target
        most = self._config.max_joint_acceleration_rad_s2 * STEP_S
        self.qd_target = self.qd_target + change / max(1.0, float(np.abs(change).max()) / most)
        self.q_target = self.q_target + self.qd_target * STEP_S
        before = self.qd
        keep = math.exp(-STEP_S / self._config.lag_s)
        self.qd = self.qd_target + (before - self.qd_target) * keep
        if not np.any(self.qd_target) and np.abs(self.qd).max() < 1e-6:
            self.qd = np.zeros(6)
        self.q = self.q + 0.5 * (before + self.qd) * STEP_S
        self.T_base_tool, self.J = pose_and_jacobian(self.q, self.T_flange_tool)

    def _enter(self, mode: Mode) -> None:
        if mode is self.mode:
            return
        if mode in (Mode.SPEED_TOOL, Mode.STOP_TOOL) and self.mode not in (
            Mode.SPEED_TOOL,
            Mode.STOP_TOOL,
        ):
            self._twist_ref = self.J @ self.qd_target
        if mode is Mode.MOVE or self.mode is Mode.MOVE:
            self.q_target = self.q.copy()
        self.mode = mode

    def _wanted_rates(self) -> FloatArray:
        a = self._acceleration
        if self.mode in (Mode.SPEED_TOOL, Mode.STOP_TOOL):
            goal = self._goal * self.speed_scaling
            self._twist_ref[:3] = _towards(self._twist_ref[:3], goal[:3], a * STEP_S)
            self._twist_ref[3:] = _towards(self._twist_ref[3:], goal[3:], a * STEP_S)
            if not np.any(self._twist_ref):
                return np.zeros(6)
            return joint_rates(self.J, self._twist_ref)
        if self.mode is Mode.SPEED_JOINT:
            return _towards(self.qd_target, self._goal * self.speed_scaling, a * STEP_S)
        if self.mode is Mode.MOVE:
            return self._move_rates()
        return _towards(self.qd_target, np.zeros(6), a * STEP_S)

    def _move_rates(self) -> FloatArray:
        """The leading joint's trapezoid, the others in proportion; ends exactly on the goal."""
        rest = self._goal - self.q_target
        distance = float(np.abs(rest).max())
        if distance < 1e-9:
            return np.zeros(6)
        present = float(np.abs(self.qd_target).max())
        brake = math.sqrt(2.0 * self._acceleration * distance)
        speed = min(self._speed, brake, present + self._acceleration * STEP_S, distance / STEP_S)
        rates: FloatArray = rest / distance * speed
        return rates


def _towards(present: FloatArray, goal: FloatArray, step: float) -> FloatArray:
    """``present`` moved straight towards ``goal`` by ``step`` at most."""
    rest = goal - present
    distance = float(np.linalg.norm(rest))
    return goal.copy() if distance <= step else present + rest * (step / distance)
