"""Drive any arm at one twist for a while, within limits, and measure what it really did."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import ConfigError, DeviceTimeoutError, SafetyError
from drivers.interfaces import Arm, ArmState, JointArm
from rig.config_safety import SafetyConfig
from rig.deadman import Deadman
from rig.envelope import Envelope, Surroundings
from rig.safety import Limiter
from rig.schedule import TickStats, tick_grid
from rig.sender import Sender

FloatArray = NDArray[np.float64]

_RATE_HZ = 100.0
HOLD_S = 0.05  # how long a command lives
_HELD_UP_S = 0.5  # that long ago nobody wants the motion any more
_BASELINE_S = 0.15  # of listening at rest, for what counts as motion
_FIRST_STATE_S = 2.0
_REST_TIMEOUT_S = 3.0
_QUIET_STATES = 5  # in a row below the threshold: at rest
_LEVER_M = 0.25  # a rotation counts as the speed it gives a point this far away
_LEAST_MOTION_M_S = 5e-4


@dataclass(frozen=True, slots=True)
class JogResult:
    """What was asked, what was sent, and what the arm measured; twists in the asked frame.

    Times are resolved no finer than the arm averages its twists over.
    """

    commanded: FloatArray  # (6,)
    allowed: FloatArray  # (6,) the last one sent
    measured: FloatArray  # (6,) mean over the second half of the motion
    limited_by: tuple[str, ...]
    latency_s: float | None  # command → first state that moves; None: it never moved
    stop_s: float | None  # stop → last state that moves; None: not at rest in time
    moved_m: float  # path of the tool's origin
    states: int
    state_rate_hz: float
    overruns: int
    interrupted: bool


def jog(
    arm: Arm,
    clock: Clock,
    twist: FloatArray,
    in_base: bool,
    duration_s: float,
    safety: SafetyConfig,
    stop_requested: Callable[[], bool],
    T_tool_camera: FloatArray | None = None,
    deadman: Deadman | None = None,
) -> JogResult:
    """Command ``twist`` (6,) in tool or base axes for ``duration_s``, then stop and watch.

    With ``T_tool_camera`` (4, 4) the camera is kept off the table too; on the wall clock a
    ``deadman`` guards every command. The arm has been told to stop when this returns or raises.
    Raises ConfigError for a twist that is no motion, SafetyError where the program was held up
    or as the limiter does, OperateError as the arm does.
    """
    if twist.shape != (6,) or not np.all(np.isfinite(twist)) or not np.any(twist):
        raise ConfigError(f"a jog needs six finite numbers, not all zero, got {twist.tolist()}")
    limiter = Limiter(safety, Envelope(safety, T_tool_camera))
    run = _Jog(arm, clock, twist, in_base, limiter, deadman)
    try:
        run.listen()
        interrupted = run.drive(duration_s, stop_requested)
        stopped_s = clock.now_s()
        arm.stop()
        run.watch_stop()
    finally:
        arm.stop()
    return run.result(stopped_s, interrupted)


class _Jog:
    def __init__(
        self,
        arm: Arm,
        clock: Clock,
        twist: FloatArray,
        in_base: bool,
        limiter: Limiter,
        deadman: Deadman | None,
    ) -> None:
        self._arm = arm
        self._clock = clock
        self._twist = twist
        self._in_base = in_base
        self._limiter = limiter
        self._sender = Sender(arm, clock, limiter, HOLD_S, deadman)
        self._joint_arm: JointArm | None = arm if isinstance(arm, JointArm) else None
        self._states: list[ArmState] = []
        self._allowed = np.zeros(6)
        self._reasons: set[str] = set()
        self._stats = TickStats()
        self._threshold = _LEAST_MOTION_M_S
        self._first_command_s = 0.0

    def listen(self) -> None:
        """Learn the arm's noise at rest; raises DeviceTimeoutError when it says nothing."""
        start_s = self._clock.now_s()
        while not self._states or self._clock.now_s() - start_s < _BASELINE_S:
            self._states += self._arm.read_states()
            if not self._states and self._clock.now_s() - start_s > _FIRST_STATE_S:
                raise DeviceTimeoutError("the arm reports no state: check its connection and power")
            self._clock.sleep_until(self._clock.now_s() + 1.0 / _RATE_HZ)
        noise = max(_magnitude(state.twist_tool) for state in self._states)
        self._threshold = max(1.5 * noise, _LEAST_MOTION_M_S)

    def drive(self, duration_s: float, stop_requested: Callable[[], bool]) -> bool:
        """Command until the time is over; whether it was interrupted."""
        last_s = self._first_command_s = self._clock.now_s()
        for now_s in tick_grid(self._clock, 1.0 / _RATE_HZ, self._stats):
            self._states += self._arm.read_states()
            state = self._states[-1]
            self._limiter.check_state(state, now_s)
            if stop_requested():
                return True
            if now_s - last_s > _HELD_UP_S:
                raise SafetyError(
                    f"the program was held up for {now_s - last_s:.1f} s and the arm stopped "
                    "meanwhile: jog again"
                )
            if now_s - self._first_command_s >= duration_s:
                break
            wanted = self._twist
            if self._in_base:
                wanted = _rotate(state.T_base_tool[:3, :3].T, wanted)
            dt_s = min(max(now_s - last_s, 1.0 / _RATE_HZ), 3.0 / _RATE_HZ)
            allowed = self._sender.send(wanted, self._surroundings(state), now_s, dt_s)
            self._allowed = allowed.twist_tool
            self._reasons.update(allowed.reasons)
            last_s = now_s
        return False

    def _surroundings(self, state: ArmState) -> Surroundings:
        joints = None if self._joint_arm is None else self._joint_arm.joints()
        return Surroundings(state, joints=joints)

    def watch_stop(self) -> None:
        """Read on until the arm is at rest, or for 3 s."""
        deadline_s = self._clock.now_s() + _REST_TIMEOUT_S
        while self._clock.now_s() < deadline_s:
            self._clock.sleep_until(self._clock.now_s() + 1.0 / _RATE_HZ)
            fresh = self._arm.read_states()
            self._states += fresh
            if fresh and self._at_rest():
                return

    def result(self, stopped_s: float, interrupted: bool) -> JogResult:
        """Everything measured."""
        states = self._states
        moving = [s for s in states if self._moves(s)]
        started = [s.t_s for s in moving if s.t_s >= self._first_command_s]
        middle_s = 0.5 * (self._first_command_s + stopped_s)
        steady = [s for s in states if middle_s <= s.t_s <= stopped_s]
        last = [s.t_s for s in moving if s.t_s > stopped_s]
        span_s = states[-1].t_s - states[0].t_s
        path = np.array([s.T_base_tool[:3, 3] for s in states])
        return JogResult(
            commanded=self._twist,
            allowed=self._seen(states[-1], self._allowed),
            measured=np.mean([self._seen(s, s.twist_tool) for s in steady or states], axis=0),
            limited_by=tuple(sorted(self._reasons)),
            latency_s=started[0] - self._first_command_s if started else None,
            stop_s=max([t_s - stopped_s for t_s in last], default=0.0) if self._at_rest() else None,
            moved_m=float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()),
            states=len(states),
            state_rate_hz=(len(states) - 1) / span_s if span_s > 0.0 else 0.0,
            overruns=self._stats.overruns,
            interrupted=interrupted,
        )

    def _seen(self, state: ArmState, twist_tool: FloatArray) -> FloatArray:
        """A tool twist in the frame that was asked for."""
        if self._in_base:
            return _rotate(state.T_base_tool[:3, :3], twist_tool)
        return twist_tool

    def _moves(self, state: ArmState) -> bool:
        return _magnitude(state.twist_tool) > self._threshold

    def _at_rest(self) -> bool:
        return not any(self._moves(state) for state in self._states[-_QUIET_STATES:])


def _magnitude(twist: FloatArray) -> float:
    """One speed (m/s) for linear and angular motion together."""
    return float(np.hypot(np.linalg.norm(twist[:3]), _LEVER_M * np.linalg.norm(twist[3:])))


def _rotate(R: FloatArray, twist: FloatArray) -> FloatArray:
    """Both parts of a twist in other axes."""
    return np.concatenate([R @ twist[:3], R @ twist[3:]])
