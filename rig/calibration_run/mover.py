"""Brings the tool to poses and along motions, through velocity commands within the envelope."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import DeviceTimeoutError, MotionRefusedError
from drivers.interfaces import Arm, ArmState, JointArm, Joints
from rig.calibration import se3
from rig.calibration_run.errors import PoseRefusedError, StopRequestedError
from rig.calibration_run.reach import Reach
from rig.calibration_run.routes import Routes
from rig.config_safety import SafetyConfig
from rig.deadman import Deadman
from rig.envelope import Envelope, Surroundings
from rig.safety import Limiter
from rig.schedule import TickStats, tick_grid
from rig.sender import Sender

FloatArray = NDArray[np.float64]

_PERIOD_S = 0.01
_GAIN_PER_S = 4.0
_DELAY_SHARE = 0.25  # the gain times the arm's delay stays below this: well damped
_NEAR_M, _NEAR_RAD = 5e-4, 1e-3  # close enough: where it came to rest is what counts
_AT_REST_M_S, _AT_REST_RAD_S = 2e-3, 8e-3
_REST_S = 0.15  # at rest for this long: settled
_FIRST_STATE_S = 2.0
_ATTEMPTS = 3
_PATIENCE = 3.0  # times the duration that the way should take
_LEAST_PATIENCE_S = 3.0


class Mover:
    """Drives one arm at a fraction of its envelope's speed and remembers all it reported.

    ``speed`` is that fraction. ``on_tick`` is called with the time of every tick, moving or
    waiting, for whoever collects images meanwhile. With ``T_tool_camera`` (4, 4) the camera is
    kept off the table too; on the wall clock a ``deadman`` guards every motion.
    """

    def __init__(
        self,
        arm: Arm,
        clock: Clock,
        safety: SafetyConfig,
        hold_s: float,
        stop_requested: Callable[[], bool],
        speed: float = 0.7,
        T_tool_camera: FloatArray | None = None,
        deadman: Deadman | None = None,
    ) -> None:
        self._arm = arm
        self._joint_arm: JointArm | None = arm if isinstance(arm, JointArm) else None
        self._clock = clock
        self._safety = safety
        self._T_tool_camera = T_tool_camera
        self._limiter = Limiter(safety, Envelope(safety, T_tool_camera))
        self._deadman = deadman
        self._sender = Sender(arm, clock, self._limiter, hold_s, deadman)
        self._stop_requested = stop_requested
        self._speed = speed
        self._gain_per_s = min(_GAIN_PER_S, _DELAY_SHARE / max(safety.reaction_time_s, 1e-3))
        self._rests: list[FloatArray] = []  # where it stood first, and where it stood last
        self.states: list[ArmState] = []
        self.on_tick: Callable[[float], None] = lambda now_s: None

    @property
    def T_base_tool(self) -> FloatArray:
        """The newest measured pose (4, 4)."""
        return self._newest().T_base_tool

    def reach(self) -> Reach:
        """Tells to which poses the straight way from here is free."""
        return Reach(self._safety, self._newest(), self._joints(), self._T_tool_camera)

    def routes(self) -> Routes:
        """Tells to which poses a way from here is free, straight or by way of where it was."""
        return Routes(self.reach(), self._rests)

    def go_to(self, T_base_tool: FloatArray) -> None:
        """Move to a pose (4, 4), straight or by way of where it was before, and rest there.

        Raises PoseRefusedError when no way is free, before anything moves, or it takes far too
        long, and StopRequestedError; the arm rests then as well.
        """
        self._read(self._clock.now_s())
        if not self._rests:
            self._rests.append(self.T_base_tool)
        for way in self.routes().to(T_base_tool):
            self._go_straight(way.T_base_tool, way.duration_s / self._speed)
        self._rests = [self._rests[0], self.T_base_tool]

    def _go_straight(self, T_base_tool: FloatArray, duration_s: float) -> None:
        patience_s = _PATIENCE * duration_s + _LEAST_PATIENCE_S
        start_s = self._clock.now_s()

        def towards(elapsed_s: float, state: ArmState) -> FloatArray | None:
            way = se3.log(se3.inverse(state.T_base_tool) @ T_base_tool)
            near = np.linalg.norm(way[:3]) < _NEAR_M and np.linalg.norm(way[3:]) < _NEAR_RAD
            return None if near else self._approach(way)

        for _ in range(_ATTEMPTS):
            blocked = self._drive(towards, patience_s)
            self.settle()
            left = self._way(T_base_tool)
            apart_m, apart_rad = (float(np.linalg.norm(part)) for part in (left[:3], left[3:]))
            far = apart_m > 4 * _NEAR_M or apart_rad > 4 * _NEAR_RAD
            if blocked or not far:
                break  # else it ran past: commands came late
        if far:
            why = f"blocked by: {blocked}" if blocked else "it does not get there"
            took_s = self._clock.now_s() - start_s
            raise PoseRefusedError(
                f"the arm stopped {1e3 * apart_m:.1f} mm and {np.degrees(apart_rad):.1f}° before "
                f"the pose after {took_s:.1f} s: {why}"
            )

    def follow(
        self, twist_of: Callable[[float, FloatArray], FloatArray], duration_s: float
    ) -> None:
        """Follow tool twists (6,), given by the time since the start and T_base_tool; then rest.

        Raises PoseRefusedError when the envelope blocks the motion, and StopRequestedError.
        """
        blocked = self._drive(
            lambda elapsed_s, state: (
                twist_of(elapsed_s, state.T_base_tool) if elapsed_s < duration_s else None
            ),
            duration_s + 1.0,
        )
        self.settle()
        if blocked:
            raise PoseRefusedError(f"the motion was blocked by: {blocked}")

    def settle(self, timeout_s: float = 3.0) -> float:
        """Command rest until the arm is measured at rest; the instant it was.

        Raises PoseRefusedError when it does not come to rest, StopRequestedError.
        """
        quiet_since_s = np.inf

        def rest(elapsed_s: float, state: ArmState) -> FloatArray | None:
            nonlocal quiet_since_s
            v, w = np.linalg.norm(state.twist_tool[:3]), np.linalg.norm(state.twist_tool[3:])
            if v > _AT_REST_M_S or w > _AT_REST_RAD_S:
                quiet_since_s = np.inf
            else:
                quiet_since_s = min(quiet_since_s, state.t_s)
            settled = state.t_s - quiet_since_s >= _REST_S
            return None if settled else np.zeros(6)

        self._drive(rest, timeout_s)
        if self._deadman is not None:
            self._deadman.rest()  # detecting corners may take longer than a command lives
        if not np.isfinite(quiet_since_s):
            raise PoseRefusedError(f"the arm does not come to rest within {timeout_s:.0f} s")
        return float(quiet_since_s)

    def wait(self, duration_s: float) -> None:
        """Keep the arm at rest for a while; raises StopRequestedError."""
        self._drive(lambda elapsed, _: np.zeros(6) if elapsed < duration_s else None, np.inf)
        if self._deadman is not None:
            self._deadman.rest()

    def check_stop(self) -> None:
        """Raise StopRequestedError when somebody asked to stop."""
        if self._stop_requested():
            raise StopRequestedError("stopped on request; the arm is at rest")

    def _drive(
        self, wanted_of: Callable[[float, ArmState], FloatArray | None], patience_s: float
    ) -> str:
        """Command what ``wanted_of`` says until it says None; the barrier in the way, or ""."""
        try:
            return self._tick(wanted_of, patience_s)
        except BaseException:
            self._arm.stop()  # whatever happened: it is not to move on while that is sorted out
            raise

    def _tick(
        self, wanted_of: Callable[[float, ArmState], FloatArray | None], patience_s: float
    ) -> str:
        start_s = last_s = self._clock.now_s()
        for now_s in tick_grid(self._clock, _PERIOD_S, TickStats()):
            state = self._read(now_s)
            self.on_tick(now_s)
            wanted = wanted_of(now_s - start_s, state)
            if wanted is None or now_s - start_s > patience_s:
                return ""
            dt_s = min(max(now_s - last_s, _PERIOD_S), 3 * _PERIOD_S)
            try:
                allowed = self._sender.send(wanted, self._surroundings(state), now_s, dt_s)
            except MotionRefusedError as error:
                self._arm.stop()
                self._limiter.restart()
                if np.any(wanted):
                    return str(error)
                continue  # the ramp to rest was refused: the arm brakes by itself
            if allowed.blocked:
                return allowed.blocked
            last_s = now_s
        raise AssertionError("the tick grid is endless")

    def _read(self, now_s: float) -> ArmState:
        self.states += self._arm.read_states()
        state = self._newest()
        self._limiter.check_state(state, now_s)
        self.check_stop()
        return state

    def _newest(self) -> ArmState:
        """The newest state, waited for at the very start."""
        deadline_s = self._clock.now_s() + _FIRST_STATE_S
        while not self.states:
            self.states += self._arm.read_states()
            if self._clock.now_s() > deadline_s:
                raise DeviceTimeoutError("the arm reports no state: check its connection and power")
            if not self.states:
                self._clock.sleep_until(self._clock.now_s() + _PERIOD_S)
        return self.states[-1]

    def _surroundings(self, state: ArmState) -> Surroundings:
        return Surroundings(state, joints=self._joints())

    def _joints(self) -> Joints | None:
        return None if self._joint_arm is None else self._joint_arm.joints()

    def _way(self, T_base_tool: FloatArray) -> FloatArray:
        return se3.log(se3.inverse(self.T_base_tool) @ T_base_tool)

    def _approach(self, way: FloatArray) -> FloatArray:
        """A twist along ``way``: proportional to it, no faster than allowed, able to brake."""
        safety, length = self._safety, np.linalg.norm
        fastest = self._gain_per_s
        for part, speed, acceleration in (
            (way[:3], safety.max_linear_speed_m_s, safety.max_linear_acceleration_m_s2),
            (way[3:], safety.max_angular_speed_rad_s, safety.max_angular_acceleration_rad_s2),
        ):
            distance = float(length(part))
            if distance > 0.0:
                braking = float(np.sqrt(0.5 * acceleration * distance))
                fastest = min(fastest, min(self._speed * speed, braking) / distance)
        return np.asarray(fastest * way)
