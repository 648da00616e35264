"""One control tick after another: states and images in, estimate, command, record, stop."""

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from drivers.clock import Clock
from drivers.errors import DeviceTimeoutError, RigError, SafetyError
from drivers.interfaces import Arm, ArmState
from estimator.active.controller import CameraMotion
from estimator.estimate import Estimate
from rig.commander import Commander
from rig.config import RigConfig
from rig.convergence import make_convergence
from rig.deadman import Deadman
from rig.frames import twist_map
from rig.fusion import Fusion
from rig.log.run_log import RunLog
from rig.outcome import Ending, LiveStatus, RunOutcome
from rig.rest import wait_for_rest
from rig.run_data import RunData
from rig.safety import Limiter
from rig.schedule import TickStats, tick_grid
from rig.showing import Showing
from rig.supervisor import RigState, Supervisor, Verdict
from rig.vision import Vision
from rig.watch import Watch

# After a long gap the controller and the limiter act as if it had been this many ticks.
_LONGEST_STEP_TICKS = 3.0


class RunLoop:
    """The loop of one run; it knows interfaces only, never which rig is behind them."""

    def __init__(
        self,
        clock: Clock,
        arm: Arm,
        vision: Vision,
        fusion: Fusion,
        controller: CameraMotion,
        limiter: Limiter,
        config: RigConfig,
        data: RunData,
        log: RunLog,
        stop_requested: Callable[[], bool],
        on_tick: Callable[[LiveStatus], None],
        deadman: Deadman | None = None,
    ) -> None:
        self._clock = clock
        self._arm = arm
        self._vision = vision
        self._fusion = fusion
        self._controller = controller
        self._limiter = limiter
        self._config = config
        self._data = data
        self._log = log
        self._stop_requested = stop_requested
        self._commander = Commander(arm, clock, limiter, data, log, config.arm.hold_s, deadman)
        self._period_s = 1.0 / config.run.control_rate_hz
        self._tool_from_camera = twist_map(data.T_tool_camera)
        self._watch = Watch(config, fusion, vision)
        self._supervisor = Supervisor(config.safety)
        self._convergence = make_convergence(config, data)
        self._stats = TickStats()
        self._showing = Showing(
            on_tick, fusion, data, self._stats, self._convergence, controller.status
        )
        self._started_s = 0.0
        self._last_s = 0.0  # the tick before this one
        self._first_feature_s: float | None = None
        self._envelope = ""  # the barrier that blocked the motion at the last tick
        self._last_hold = ""
        self._target_state = "searching: no image arrived yet"

    def run(self) -> RunOutcome:
        """Run until time, convergence, loss, failure or a stop request; the arm then rests.

        Failures of devices and safety stops are returned in the outcome; anything else is
        raised. In every case the arm has been told to stop.
        """
        self._started_s = self._showing.started_s = self._clock.now_s()
        self._log.event(self._started_s, "started")
        self._supervisor.start(self._started_s)
        self._watch.start(self._started_s)
        try:
            ending, error = self._until_an_end()
        except BaseException as crash:
            self._arm.stop()
            with suppress(OSError):  # a full disk must not hide what happened
                self._log.event(self._clock.now_s(), "ended", repr(crash))
            raise
        self._arm.stop()
        at_rest = wait_for_rest(self._clock, self._arm, self._fusion, self._period_s)
        ended_s = self._clock.now_s()
        if at_rest and error is None:
            self._enter(RigState.STOPPED, ending.value)
        why = ending.value if error is None else f"{ending.value}: {error}"
        self._log.event(ended_s, "ended", why)
        return RunOutcome(
            ending=ending,
            data=self._data,
            stats=self._stats,
            started_s=self._started_s,
            ended_s=ended_s,
            at_rest=at_rest,
            remaining_fraction=self._convergence.remaining_fraction,
            target_state=self._target_state,
            holds=self._supervisor.holds,
            last_hold=self._last_hold,
            error=error,
        )

    def _until_an_end(self) -> tuple[Ending, RigError | None]:
        """Tick until something ends the run, then ramp down; failures are returned."""
        ending: Ending | None = None
        error: RigError | None = None
        try:
            verdict = self._tick_until_over()
            ending, error = verdict.ending, verdict.error
            self._enter(RigState.STOPPING, verdict.detail or str(ending and ending.value))
            self._ramp_to_rest()
        except RigError as failure:
            if error is None:  # what came first is what the user has to know
                stop = isinstance(failure, SafetyError)
                ending = Ending.SAFETY_STOP if stop else Ending.DEVICE_FAILURE
                error = failure
        assert ending is not None  # either the ticks ended, or an error was raised
        if error is not None:
            self._enter(RigState.FAULT, str(error))
        return ending, error

    def _tick_until_over(self) -> Verdict:
        # What piled up while devices were opened is taken before the first tick, not within it.
        self._fusion.add_states(self._arm.read_states())
        self._last_s = self._clock.now_s() - self._period_s
        for now_s in tick_grid(self._clock, self._period_s, self._stats):
            state = self._read(now_s)
            self._log.tick(now_s, self._stats.late_s[-1], self._stats.overruns)
            estimate = self._fusion.advance(now_s)
            self._convergence.update()
            verdict = self._judge(now_s, state, estimate)
            if verdict.ending is None:
                verdict = self._own_ending(now_s, estimate) or verdict
            if verdict.ending is not None:
                return verdict
            if state is not None:
                self._command(now_s, verdict, estimate, state)
            self._last_s = now_s
        raise AssertionError("the tick grid is endless")

    def _read(self, now_s: float) -> ArmState | None:
        """Take what the devices have; the newest arm state, its motion checked."""
        self._fusion.add_states(self._arm.read_states())
        self._fusion.add_sightings(self._vision.poll(), now_s)
        state = self._fusion.state
        if state is not None:
            self._limiter.check_motion(state)
        elif now_s - self._started_s > self._config.safety.max_state_age_s:
            raise DeviceTimeoutError("the arm reports no state: check its connection and power")
        return state

    def _judge(self, now_s: float, state: ArmState | None, estimate: Estimate | None) -> Verdict:
        """What the supervisor makes of this tick."""
        signs = self._watch.signs(now_s, self._last_s, state, self._still_blocked(estimate, state))
        self._follow_target(now_s, signs.target_lost or signs.no_image)
        if signs.overrun:
            self._log.event(now_s, "overrun", signs.overrun)
            self._commander.restart()
        before = self._supervisor.state
        verdict = self._supervisor.judge(signs)
        if verdict.state is not before and verdict.ending is None:
            self._log.event(now_s, f"state {verdict.state}", verdict.detail)
        if verdict.state is RigState.HOLDING:
            self._last_hold = verdict.detail
        return verdict

    def _still_blocked(self, estimate: Estimate | None, state: ArmState | None) -> str:
        """The barrier in the way: as the last tick found it, or while holding, looked at anew."""
        if not self._envelope or state is None or estimate is None:
            return ""
        if self._supervisor.state is RigState.HOLDING:
            wanted = self._tool_from_camera @ self._controller.twist(estimate, 0.0)
            self._envelope = self._commander.still_blocked(wanted, state, estimate)
        return self._envelope

    def _follow_target(self, now_s: float, missing: str) -> None:
        """Follow searching → tracking ↔ lost."""
        before = self._target_state.partition(":")[0]
        if self._fusion.last_feature_s is None:
            self._target_state = f"searching: {missing}"
            return
        if self._first_feature_s is None:
            self._first_feature_s = now_s
        self._target_state = f"lost: {missing}" if missing else "tracking"
        if self._target_state.partition(":")[0] != before:
            self._log.event(now_s, "target " + self._target_state.partition(":")[0], missing)

    def _own_ending(self, now_s: float, estimate: Estimate | None) -> Verdict | None:
        """The verdict when the run is over without any trouble."""
        run = self._config.run
        if self._stop_requested():
            return Verdict(RigState.STOPPING, ending=Ending.INTERRUPTED)
        if self._first_feature_s is not None:
            if now_s - self._first_feature_s >= run.duration_s:
                return Verdict(RigState.STOPPING, ending=Ending.TIME)
            settled = self._config.ends_when_settled and self._convergence.reached()
            if settled and estimate is not None and self._controller.arrived(estimate):
                return Verdict(RigState.STOPPING, ending=Ending.CONVERGED)
        return None

    def _command(
        self, now_s: float, verdict: Verdict, estimate: Estimate | None, state: ArmState
    ) -> None:
        """Command what the controller wants and the envelope allows; rest unless running."""
        dt_s = min(now_s - self._last_s, _LONGEST_STEP_TICKS * self._period_s)
        wanted = np.zeros(6)
        if estimate is not None and verdict.state is RigState.RUNNING:
            wanted = self._tool_from_camera @ self._controller.twist(estimate, dt_s)
        allowed = self._commander.send(now_s, wanted, state, estimate, dt_s)
        if verdict.state is RigState.RUNNING:
            self._envelope = allowed.blocked
        text = f"{verdict.state}: {verdict.detail}" if verdict.detail else verdict.state
        self._showing.show(now_s, text, self._target_state, estimate, allowed.reasons)

    def _ramp_to_rest(self) -> None:
        """Bring the command to zero within the acceleration limits, still watching the arm."""
        last_s = self._clock.now_s()
        for now_s in tick_grid(self._clock, self._period_s, TickStats()):
            state = self._read(now_s)
            if state is None:
                return
            self._limiter.check_age(state, now_s)
            dt_s = min(now_s - last_s, _LONGEST_STEP_TICKS * self._period_s) or self._period_s
            allowed = self._commander.send(now_s, np.zeros(6), state, None, dt_s)
            last_s = now_s
            self._showing.show(now_s, self._supervisor.state, self._target_state, None)
            if not np.any(allowed.twist_tool):
                return

    def _enter(self, state: RigState, detail: str) -> None:
        now_s = self._clock.now_s()
        self._supervisor.enter(state, now_s, detail)
        self._log.event(now_s, f"state {state}", detail)
        self._showing.show(now_s, f"{state}: {detail}", self._target_state, None)
