"""One run from configuration to summary: build, loop, analyse, write."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from drivers.clock import Clock, WallClock
from estimator.active.controller import Controller
from estimator.active.policy import ConstantVelocity, PaperPolicy, VelocityPolicy
from estimator.image.intrinsics import Intrinsics
from estimator.image.tracker import TargetTracker, warm_up
from estimator.models.cylinder import Cylinder
from estimator.models.sphere import Sphere
from estimator.observer import Observer
from rig.analysis import Analysis, analyse
from rig.build import Rig, build_rig
from rig.config import MotionConfig, RigConfig, TargetKind
from rig.fusion import Fusion
from rig.live import View
from rig.loop import RunLoop, RunOutcome
from rig.records import Json, RunLog
from rig.run_data import RunData
from rig.summary import summarise
from rig.vision import InlineVision, ThreadedVision


@dataclass(frozen=True, slots=True)
class RunResult:
    """Everything a finished run left in memory."""

    summary: dict[str, Json]
    outcome: RunOutcome
    analysis: Analysis
    intrinsics: Intrinsics


def execute(
    config: RigConfig,
    target: TargetKind,
    run_dir: Path,
    realtime: bool,
    view: View,
    stop_requested: Callable[[], bool],
) -> RunResult:
    """Run once; the arm rests, and the log and configuration are written, when this returns.

    Raises ConnectError when a device cannot be opened; failures during the run are in
    ``outcome.error``.
    """
    with build_rig(config, target, realtime) as rig, RunLog(run_dir, config) as log:
        warm_up(target, rig.intrinsics, config.camera.method)
        data = RunData(target=target, T_tool_camera=rig.T_tool_camera)
        tracker = TargetTracker(target, rig.intrinsics, config.camera.method)
        vision = (ThreadedVision if rig.realtime else InlineVision)(rig.camera, tracker)
        loop = RunLoop(
            clock=rig.clock,
            arm=rig.arm,
            vision=vision,
            fusion=Fusion(make_observer(config, target), data, log, config.safety.max_state_age_s),
            controller=make_controller(config.motion),
            config=config,
            data=data,
            log=log,
            stop_requested=stop_requested,
            on_tick=view.show,
        )
        wall: Clock = WallClock()
        wall_start_s = wall.now_s()
        try:
            with view:
                outcome = loop.run()
        finally:
            vision.close()
        wall_s = wall.now_s() - wall_start_s
        return _result(rig, outcome, config, target, run_dir, wall_s)


def _result(
    rig: Rig,
    outcome: RunOutcome,
    config: RigConfig,
    target: TargetKind,
    run_dir: Path,
    wall_s: float,
) -> RunResult:
    radius_true_m = None if rig.truth is None else rig.truth.radius_m
    analysis = analyse(outcome.data, config, radius_true_m)
    summary = summarise(target, outcome, analysis, config, rig.renderer, wall_s, run_dir)
    return RunResult(summary, outcome, analysis, rig.intrinsics)


def make_observer(config: RigConfig, target: TargetKind) -> Observer:
    """The estimator that the configuration asks for."""
    model = Sphere() if target == "sphere" else Cylinder()
    estimator = config.estimator
    return Observer(model, estimator.alpha, estimator.damping, estimator.radius_guess_m)


def make_controller(motion: MotionConfig) -> Controller:
    """The camera motion that the configuration asks for."""
    policy: VelocityPolicy
    if motion.policy == "constant":
        policy = ConstantVelocity(motion.velocity_m_s)
    else:
        policy = PaperPolicy(motion.velocity_m_s, motion.k1, motion.k2)
    return Controller(policy, motion.centring_gain_per_s)
