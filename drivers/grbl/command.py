"""The newest command: what was asked, until when, and the axis rates that make it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.grbl.controller import Controller
from drivers.grbl.errors import LimitError, MotionError
from drivers.grbl.kinematics import GantryKinematics
from drivers.grbl.limits import AxisLimits
from drivers.grbl.settings import AxisSettings, GrblSettings
from drivers.interfaces import Joints

FloatArray = NDArray[np.float64]

# A missing rotation smaller than this is rounding; relative to the one asked for, and absolute.
_ROTATION_SHARE = 0.01
_ROTATION_RAD_S = 1e-3
_MARGIN_S = 0.020


@dataclass(frozen=True, slots=True)
class Plan:
    """What the next block is to be."""

    rates: FloatArray  # (n,) units per second
    lookahead_s: float  # how much motion to keep under way at these rates


class Commander:
    """Holds one tool twist at a time and turns it into axis rates where it will be executed."""

    def __init__(
        self,
        settings: GrblSettings,
        axes: tuple[AxisSettings, ...],
        controller: Controller,
        kinematics: GantryKinematics,
        lookahead_s: float,
    ) -> None:
        self._settings = settings
        self._kinematics = kinematics
        self._limits = AxisLimits(axes, controller)
        self._acceleration = controller.acceleration
        self._lookahead_s = lookahead_s
        self._twist: FloatArray | None = None
        self._expires_s = float("-inf")
        self._planned_for: tuple[FloatArray, Plan] | None = None

    def set(self, twist_tool: FloatArray, hold_s: float, now_s: float, mpos: FloatArray) -> None:
        """Take a command, checked at the machine position ``mpos`` (n,).

        Raises MotionError for no number, or a rotation that the axes lack; LimitError where
        an axis at the end of its range would have to go on.
        """
        twist = np.array(twist_tool, dtype=float)
        if twist.shape != (6,) or not np.all(np.isfinite(twist)) or not 0.0 <= hold_s < np.inf:
            raise MotionError(
                f"the gantry refused the twist {twist.tolist()} for {hold_s!r} s and stopped: "
                "a command is six finite numbers and a finite hold time"
            )
        rates, missing = self._rates(twist, mpos)
        self._check_rotation(missing, twist)
        blocked = self._limits.blocked_by(mpos, rates)
        if blocked is not None:
            raise LimitError(f"the gantry stopped: axis {blocked}; command a motion away from it")
        self._twist, self._expires_s, self._planned_for = twist, now_s + hold_s, None

    def joints_at(self, mpos: FloatArray) -> Joints:
        """The joints at machine coordinates ``mpos`` (n,), with the configured ranges."""
        kinematics = self._kinematics
        ends = np.sort([kinematics.joints(end) for end in (self._limits.low, self._limits.high)], 0)
        linear = tuple(name in ("x", "y", "z") for name in kinematics.names)
        q = kinematics.joints(mpos)
        return Joints(kinematics.names, q, ends[0], ends[1], linear, kinematics.tool_jacobian)

    def clear(self) -> None:
        """Forget the command: rest."""
        self._twist = None

    def expired(self, now_s: float) -> bool:
        """Whether there is a command that has outlived its hold time."""
        return self._twist is not None and now_s >= self._expires_s

    def plan(self, mpos: FloatArray, now_s: float) -> Plan:
        """What to send for a block that begins at ``mpos`` (n,)."""
        if self._twist is None or now_s >= self._expires_s:
            return Plan(np.zeros_like(mpos), self._lookahead_s)
        # Asked for every 2 ms, but different only after a new command or block.
        if self._planned_for is None or self._planned_for[0] is not mpos:
            rates, _ = self._rates(self._twist, mpos)
            scaled: FloatArray = self._limits.scale(mpos, rates) * rates
            self._planned_for = mpos, Plan(scaled, self._lookahead_for_s(scaled))
        return self._planned_for[1]

    def _lookahead_for_s(self, rates: FloatArray) -> float:
        # The controller's plan always ends at rest, so it only keeps a speed that it can brake
        # from within what lies ahead: speed / (2 acceleration) seconds of it.
        speed = float(np.linalg.norm(rates))
        if speed == 0.0:
            return self._lookahead_s
        parts = np.maximum(np.abs(rates) / speed, 1e-9)
        braking_s = speed / (2.0 * float(np.min(self._acceleration / parts)))
        return max(self._lookahead_s, braking_s + _MARGIN_S)

    def _check_rotation(self, missing: FloatArray, twist: FloatArray) -> None:
        if self._settings.on_rotation == "drop" or self._kinematics.rotations == 3:
            return  # a whole wrist lacks rotation only near its singularity, by design
        lacking = float(np.linalg.norm(missing))
        if lacking > max(_ROTATION_RAD_S, _ROTATION_SHARE * float(np.linalg.norm(twist[3:]))):
            raise MotionError(
                f"the gantry has no axis for a rotation of {lacking:.3g} rad/s and stopped: "
                "plan translations only, or set arm.on_rotation to drop"
            )

    def _rates(self, twist: FloatArray, mpos: FloatArray) -> tuple[FloatArray, FloatArray]:
        qd, missing = self._kinematics.joint_rates(self._kinematics.joints(mpos), twist)
        return self._kinematics.axis_rates_of(qd), missing
