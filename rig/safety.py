"""The last word on every command: speed, acceleration and workspace, and why it was cut."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.errors import SafetyError
from drivers.interfaces import ArmState
from rig.config import SafetyConfig

FloatArray = NDArray[np.float64]

# A measured speed this far above the limit means that the arm does not follow its commands.
_RUNAWAY_FACTOR = 1.5
_RUNAWAY_MARGIN_M_S = 0.02
# Encoder noise at a workspace wall is no breach.
_WORKSPACE_MARGIN_M = 0.01


@dataclass(frozen=True, slots=True)
class Allowed:
    """What the arm may do of what was asked."""

    twist_tool: FloatArray  # (6,)
    reasons: tuple[str, ...]  # empty when nothing was cut


class Limiter:
    """Holds every commanded tool twist inside the envelope, starting from the measured motion."""

    def __init__(self, config: SafetyConfig) -> None:
        self._config = config
        self._last: FloatArray | None = None

    def check_state(self, state: ArmState, now_s: float) -> None:
        """Raise SafetyError when the arm's measured state is old, too fast or out of bounds."""
        config = self._config
        age_s = now_s - state.t_s
        if age_s > config.max_state_age_s:
            raise SafetyError(
                f"the arm's newest state is {age_s:.3f} s old (limit "
                f"{config.max_state_age_s:.3f} s): check its connection"
            )
        speed_m_s = float(np.linalg.norm(state.twist_tool[:3]))
        if speed_m_s > _RUNAWAY_FACTOR * config.max_linear_speed_m_s + _RUNAWAY_MARGIN_M_S:
            raise SafetyError(
                f"the arm moves at {speed_m_s:.3f} m/s, limit {config.max_linear_speed_m_s:.3f}: "
                "it does not follow its commands; check the controller"
            )
        position_m = state.T_base_tool[:3, 3]
        below = np.asarray(config.workspace_min_m) - position_m
        above = position_m - np.asarray(config.workspace_max_m)
        if max(below.max(), above.max()) > _WORKSPACE_MARGIN_M:
            raise SafetyError(
                f"the tool is at {np.round(position_m, 3).tolist()} m, outside the workspace "
                f"{list(config.workspace_min_m)} … {list(config.workspace_max_m)}: "
                "jog it back inside or widen safety.workspace_*"
            )

    def limit(self, twist_tool: FloatArray, state: ArmState, dt_s: float) -> Allowed:
        """The allowed twist for the next tick; raises SafetyError on a twist that is no number."""
        if not np.all(np.isfinite(twist_tool)):
            raise SafetyError("the controller asked for a motion that is not a number")
        config = self._config
        reasons: list[str] = []
        allowed = self._within_speed(np.asarray(twist_tool, dtype=float), reasons)
        allowed = self._within_workspace(allowed, state, reasons)
        last = state.twist_tool if self._last is None else self._last
        step = allowed - last
        allowed = last + np.concatenate(
            [
                _clip_norm(step[:3], config.max_linear_acceleration_m_s2 * dt_s, "linear", reasons),
                _clip_norm(
                    step[3:], config.max_angular_acceleration_rad_s2 * dt_s, "angular", reasons
                ),
            ]
        )
        self._last = allowed
        return Allowed(allowed, tuple(reasons))

    def _within_speed(self, twist: FloatArray, reasons: list[str]) -> FloatArray:
        """Scale the whole twist, so that the path keeps its shape."""
        config = self._config
        linear = float(np.linalg.norm(twist[:3])) / config.max_linear_speed_m_s
        angular = float(np.linalg.norm(twist[3:])) / config.max_angular_speed_rad_s
        excess = max(linear, angular)
        if excess <= 1.0:
            return twist
        reasons.append("linear speed" if linear >= angular else "angular speed")
        return twist / excess

    def _within_workspace(
        self, twist: FloatArray, state: ArmState, reasons: list[str]
    ) -> FloatArray:
        """Slow the approach to each wall to what half the acceleration can still stop."""
        config = self._config
        R_base_tool, position_m = state.T_base_tool[:3, :3], state.T_base_tool[:3, 3]
        velocity_base = R_base_tool @ twist[:3]
        brake = config.max_linear_acceleration_m_s2  # 2 · (a / 2) · distance
        to_max = np.maximum(np.asarray(config.workspace_max_m) - position_m, 0.0)
        to_min = np.maximum(position_m - np.asarray(config.workspace_min_m), 0.0)
        clipped = np.clip(velocity_base, -np.sqrt(brake * to_min), np.sqrt(brake * to_max))
        if np.array_equal(clipped, velocity_base):
            return twist
        reasons.append("workspace")
        return np.concatenate([R_base_tool.T @ clipped, twist[3:]])


def _clip_norm(step: FloatArray, largest: float, kind: str, reasons: list[str]) -> FloatArray:
    norm = float(np.linalg.norm(step))
    if norm <= largest:
        return step
    reasons.append(f"{kind} acceleration")
    return step * (largest / norm)
