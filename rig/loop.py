"""One control tick after another: states and images in, estimate, command, record, stop."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from drivers.clock import Clock
from drivers.errors import DeviceTimeoutError, RigError, SafetyError
from drivers.interfaces import Arm, ArmState
from estimator.active.controller import Controller
from estimator.estimate import Estimate
from rig.config import RigConfig
from rig.convergence import Convergence
from rig.frames import twist_map
from rig.fusion import Fusion
from rig.records import RunLog
from rig.run_data import RunData
from rig.safety import Limiter
from rig.schedule import TickStats, tick_grid
from rig.vision import Vision

_AT_REST_M_S = 2e-3
_AT_REST_RAD_S = 1e-2
_REST_TIMEOUT_S = 3.0
# After a long gap the controller and the limiter act as if it had been this many ticks.
_LONGEST_STEP_TICKS = 3.0


class Ending(Enum):
    """Why a run ended."""

    TIME = "duration reached"
    CONVERGED = "converged"
    INTERRUPTED = "interrupted"
    TARGET_LOST = "target lost"
    SAFETY_STOP = "safety stop"
    DEVICE_FAILURE = "device failure"


@dataclass(frozen=True, slots=True)
class LiveStatus:
    """What a person watching wants to know, once a tick."""

    elapsed_s: float  # since the loop started
    estimate: Estimate | None
    target_state: str  # "searching: …", "tracking", "lost: …"
    frames: int
    frames_lost: int
    ticks: int
    overruns: int
    speed_m_s: float  # measured, of the camera
    limited_by: tuple[str, ...]
    remaining_fraction: float  # predicted rest of the observer's transient


@dataclass(frozen=True, slots=True)
class RunOutcome:
    """How a run went; ``error`` is set when a device or the safety ended it."""

    ending: Ending
    data: RunData
    stats: TickStats
    started_s: float
    ended_s: float
    at_rest: bool
    remaining_fraction: float
    target_state: str
    error: RigError | None


class RunLoop:
    """The loop of one run; it knows interfaces only, never which rig is behind them."""

    def __init__(
        self,
        clock: Clock,
        arm: Arm,
        vision: Vision,
        fusion: Fusion,
        controller: Controller,
        config: RigConfig,
        data: RunData,
        log: RunLog,
        stop_requested: Callable[[], bool],
        on_tick: Callable[[LiveStatus], None],
    ) -> None:
        self._clock = clock
        self._arm = arm
        self._vision = vision
        self._fusion = fusion
        self._controller = controller
        self._config = config
        self._data = data
        self._log = log
        self._stop_requested = stop_requested
        self._on_tick = on_tick
        self._period_s = 1.0 / config.run.control_rate_hz
        self._limiter = Limiter(config.safety)
        self._convergence = Convergence(config, data)
        self._stats = TickStats()
        self._started_s = 0.0
        self._first_feature_s: float | None = None
        self._target_state = "searching: no image arrived yet"

    def run(self) -> RunOutcome:
        """Run until time, convergence, loss, failure or a stop request; the arm then rests.

        Failures of devices and safety stops are returned in the outcome; anything else is
        raised. In every case the arm has been told to stop.
        """
        self._started_s = self._clock.now_s()
        self._log.event(self._started_s, "started")
        error: RigError | None = None
        try:
            ending = self._until_an_end()
            self._ramp_to_rest()
        except SafetyError as stop:
            ending, error = Ending.SAFETY_STOP, stop
        except RigError as failure:
            ending, error = Ending.DEVICE_FAILURE, failure
        finally:
            self._arm.stop()
        at_rest = self._wait_for_rest()
        ended_s = self._clock.now_s()
        self._log.event(ended_s, "ended", ending.value if error is None else str(error))
        return RunOutcome(
            ending=ending,
            data=self._data,
            stats=self._stats,
            started_s=self._started_s,
            ended_s=ended_s,
            at_rest=at_rest,
            remaining_fraction=self._convergence.remaining_fraction,
            target_state=self._target_state,
            error=error,
        )

    def _until_an_end(self) -> Ending:
        # What piled up while devices were opened is taken before the first tick, not within it.
        self._fusion.add_states(self._arm.read_states())
        last_s = self._clock.now_s() - self._period_s
        for now_s in tick_grid(self._clock, self._period_s, self._stats):
            state = self._read(now_s)
            estimate = self._fusion.advance(now_s)
            self._convergence.update()
            self._watch_target(now_s)
            ending = self._ending(now_s)
            if ending is not None:
                return ending
            if state is not None:
                dt_s = min(now_s - last_s, _LONGEST_STEP_TICKS * self._period_s)
                self._command(now_s, dt_s, estimate, state)
            last_s = now_s
        raise AssertionError("the tick grid is endless")

    def _read(self, now_s: float) -> ArmState | None:
        """Take what the devices have; the newest arm state, checked."""
        self._fusion.add_states(self._arm.read_states())
        self._fusion.add_sightings(self._vision.poll(), now_s)
        state = self._fusion.state
        if state is not None:
            self._limiter.check_state(state, now_s)
        elif now_s - self._started_s > self._config.safety.max_state_age_s:
            raise DeviceTimeoutError("the arm reports no state: check its connection and power")
        return state

    def _watch_target(self, now_s: float) -> None:
        """Follow searching → tracking ↔ lost by the age of the last feature."""
        fusion, before = self._fusion, self._target_state.partition(":")[0]
        if fusion.last_feature_s is None:
            self._target_state = f"searching: {fusion.reason}"
            return
        if self._first_feature_s is None:
            self._first_feature_s = now_s
        age_s = now_s - fusion.last_feature_s
        fresh = age_s <= self._config.safety.max_feature_age_s
        self._target_state = "tracking" if fresh else f"lost: {fusion.reason}"
        if self._target_state.partition(":")[0] != before:
            self._log.event(now_s, "target " + self._target_state.partition(":")[0], fusion.reason)

    def _ending(self, now_s: float) -> Ending | None:
        run, safety = self._config.run, self._config.safety
        if self._stop_requested():
            return Ending.INTERRUPTED
        seen_s = self._fusion.last_feature_s
        if now_s - (self._started_s if seen_s is None else seen_s) > safety.target_lost_after_s:
            return Ending.TARGET_LOST
        if self._first_feature_s is not None:
            if now_s - self._first_feature_s >= run.duration_s:
                return Ending.TIME
            if run.until_converged and self._convergence.reached():
                return Ending.CONVERGED
        return None

    def _command(
        self, now_s: float, dt_s: float, estimate: Estimate | None, state: ArmState
    ) -> None:
        """Command what the controller wants and the envelope allows; rest without a target."""
        wanted = np.zeros(6)
        if estimate is not None and self._target_state == "tracking":
            twist_camera = self._controller.twist(estimate, dt_s)
            wanted = twist_map(self._data.T_tool_camera) @ twist_camera
        allowed = self._limiter.limit(wanted, state, dt_s)
        self._arm.command_twist(allowed.twist_tool, self._config.arm.hold_s)
        self._log.command(
            now_s, wanted, allowed.twist_tool, state.twist_tool, list(allowed.reasons)
        )
        self._on_tick(
            LiveStatus(
                elapsed_s=now_s - self._started_s,
                estimate=estimate,
                target_state=self._target_state,
                frames=self._data.frames,
                frames_lost=self._data.frames_lost,
                ticks=self._stats.ticks,
                overruns=self._stats.overruns,
                speed_m_s=self._fusion.camera_speed_m_s(),
                limited_by=allowed.reasons,
                remaining_fraction=self._convergence.remaining_fraction,
            )
        )

    def _ramp_to_rest(self) -> None:
        """Bring the command to zero within the acceleration limits, still watching the arm."""
        last_s = self._clock.now_s()
        for now_s in tick_grid(self._clock, self._period_s, TickStats()):
            state = self._read(now_s)
            if state is None:
                return
            dt_s = min(now_s - last_s, _LONGEST_STEP_TICKS * self._period_s) or self._period_s
            allowed = self._limiter.limit(np.zeros(6), state, dt_s)
            self._arm.command_twist(allowed.twist_tool, self._config.arm.hold_s)
            self._log.command(
                now_s, np.zeros(6), allowed.twist_tool, state.twist_tool, list(allowed.reasons)
            )
            last_s = now_s
            if not np.any(allowed.twist_tool):
                return

    def _wait_for_rest(self) -> bool:
        """Whether the arm is measured at rest within 3 s of its stop."""
        deadline_s = self._clock.now_s() + _REST_TIMEOUT_S
        while self._clock.now_s() < deadline_s:
            try:
                self._fusion.add_states(self._arm.read_states())
            except RigError:
                return False
            state = self._fusion.state
            if state is not None and _at_rest(state):
                return True
            self._clock.sleep_until(self._clock.now_s() + self._period_s)
        return False


def _at_rest(state: ArmState) -> bool:
    return bool(
        np.linalg.norm(state.twist_tool[:3]) < _AT_REST_M_S
        and np.linalg.norm(state.twist_tool[3:]) < _AT_REST_RAD_S
    )
