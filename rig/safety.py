"""The last word on every command: the envelope kept, the direction kept, every cut explained."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.errors import SafetyError
from drivers.interfaces import ArmState
from rig.config_safety import SafetyConfig
from rig.envelope import Envelope, Surroundings

FloatArray = NDArray[np.float64]

# A measured speed this far above the limit means that the arm does not follow its commands.
_RUNAWAY_FACTOR = 1.5
_RUNAWAY_MARGIN_M_S = 0.02
_RUNAWAY_MARGIN_RAD_S = 0.1
# Encoder noise at a workspace wall is no breach.
_BREACH_MARGIN_M = 0.01
# Slowed below this share of what was asked, the motion counts as blocked.
_BLOCKED_BELOW = 0.02
# A blocked motion is free again when this share of it would be let through.
_FREE_ABOVE = 0.1
# Slower than this (1/s of whatever a barrier counts in) is rounding, not an approach: an axis that
# stands on its end after homing must not keep the others from moving.
_STANDSTILL = 1e-9
# Braking before a barrier may use this share of the acceleration limit.
_BRAKING_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class Allowed:
    """What the arm may do of what was asked."""

    twist_tool: FloatArray  # (6,)
    reasons: tuple[str, ...]  # empty when nothing was cut
    blocked: str  # the barrier that lets nothing of the motion through, or ""


class Limiter:
    """Holds every commanded tool twist inside the envelope, starting from the measured motion."""

    def __init__(self, config: SafetyConfig, envelope: Envelope | None = None) -> None:
        self._config = config
        self._envelope = envelope or Envelope(config)
        self._last: FloatArray | None = None

    def check_state(self, state: ArmState, now_s: float) -> None:
        """Raise SafetyError when the arm's measured state is old, too fast or out of bounds."""
        self.check_age(state, now_s)
        self.check_motion(state)

    def check_age(self, state: ArmState, now_s: float) -> None:
        """Raise SafetyError when the arm's newest state is too old to act upon."""
        age_s, limit_s = now_s - state.t_s, self._config.max_state_age_s
        if not age_s <= limit_s:
            raise SafetyError(
                f"the arm's newest state is {age_s:.3f} s old (limit {limit_s:.3f} s): "
                "check its connection"
            )

    def check_motion(self, state: ArmState) -> None:
        """Raise SafetyError when the arm is too fast, outside its workspace or at the table."""
        config = self._config
        for twist, limit, margin, unit in (
            (state.twist_tool[:3], config.max_linear_speed_m_s, _RUNAWAY_MARGIN_M_S, "m/s"),
            (state.twist_tool[3:], config.max_angular_speed_rad_s, _RUNAWAY_MARGIN_RAD_S, "rad/s"),
        ):
            speed = float(np.linalg.norm(twist))
            if not speed <= _RUNAWAY_FACTOR * limit + margin:
                raise SafetyError(
                    f"the arm moves at {speed:.3f} {unit}, limit {limit:.3f}: "
                    "it does not follow its commands; check the controller"
                )
        position_m = state.T_base_tool[:3, 3]
        below = np.asarray(config.workspace_min_m) - position_m
        above = position_m - np.asarray(config.workspace_max_m)
        if not max(below.max(), above.max()) <= _BREACH_MARGIN_M:
            raise SafetyError(
                f"the tool is at {np.round(position_m, 3).tolist()} m, outside the workspace "
                f"{list(config.workspace_min_m)} … {list(config.workspace_max_m)}: "
                "jog it back inside or widen safety.workspace_*"
            )
        room_m = self._envelope.table_room_m(state)
        if room_m < -_BREACH_MARGIN_M:
            raise SafetyError(
                f"tool or camera is {-room_m * 1e3:.0f} mm closer to the table than "
                "safety.table.min_distance_m allows: jog it away or correct safety.table"
            )

    def restart(self) -> None:
        """Ramp from the measured motion next time: the arm did not follow the last commands."""
        self._last = None

    def limit(self, twist_tool: FloatArray, around: Surroundings, dt_s: float) -> Allowed:
        """The allowed twist for the next tick; raises SafetyError on a twist that is no number.

        Speed limits and barriers scale the whole twist, so that its direction stays; the ramp
        towards the result then keeps the acceleration limits.
        """
        wanted = np.asarray(twist_tool, dtype=float)
        if not np.all(np.isfinite(wanted)):
            raise SafetyError("the controller asked for a motion that is not a number")
        reasons: list[str] = []
        wanted = self._within_speed(wanted, reasons)
        factor, barrier = self._slowest(wanted, around)
        if factor < 1.0:
            reasons.append(barrier)
        blocked = barrier if factor < _BLOCKED_BELOW else ""
        self._last = self._ramp(factor * wanted, around.state, dt_s, reasons)
        return Allowed(self._last, tuple(reasons), blocked)

    def still_blocked(self, twist_tool: FloatArray, around: Surroundings) -> str:
        """The barrier that still keeps a blocked ``twist_tool`` back, or ""; moves nothing on."""
        factor, barrier = self._slowest(self._within_speed(twist_tool, []), around)
        return barrier if factor < _FREE_ABOVE else ""

    def _within_speed(self, twist: FloatArray, reasons: list[str]) -> FloatArray:
        config = self._config
        linear = float(np.linalg.norm(twist[:3])) / config.max_linear_speed_m_s
        angular = float(np.linalg.norm(twist[3:])) / config.max_angular_speed_rad_s
        excess = max(linear, angular)
        if excess <= 1.0:
            return twist
        reasons.append("linear speed" if linear >= angular else "angular speed")
        return twist / excess

    def _slowest(self, twist: FloatArray, around: Surroundings) -> tuple[float, str]:
        """The share of ``twist`` that every barrier allows, and the one that allows least."""
        least, name = 1.0, ""
        if not np.any(twist):
            return least, name
        braking = _BRAKING_SHARE * self._config.max_linear_acceleration_m_s2
        for barrier in self._envelope.barriers(twist, around):
            allowed = barrier.allowed_closing(braking, self._config.reaction_time_s)
            if barrier.closing <= _STANDSTILL:
                continue
            if barrier.closing > allowed and allowed / barrier.closing < least:
                least, name = allowed / barrier.closing, barrier.name
        return least, name

    def _ramp(
        self, wanted: FloatArray, state: ArmState, dt_s: float, reasons: list[str]
    ) -> FloatArray:
        """One step on the straight line to ``wanted``: a start from rest keeps its direction."""
        config = self._config
        last = state.twist_tool if self._last is None else self._last
        step = wanted - last
        linear = float(np.linalg.norm(step[:3])) / (config.max_linear_acceleration_m_s2 * dt_s)
        angular = float(np.linalg.norm(step[3:])) / (config.max_angular_acceleration_rad_s2 * dt_s)
        excess = max(linear, angular)
        if excess <= 1.0:
            return np.asarray(wanted)
        reasons.append("linear acceleration" if linear >= angular else "angular acceleration")
        return np.asarray(last + step / excess)
