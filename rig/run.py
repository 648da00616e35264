"""One run from configuration to summary: build, loop, analyse, write."""

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from drivers.clock import Clock, WallClock, local_timestamp, time_of_day_offset_ns
from drivers.errors import ConfigError
from estimator.augmented import AugmentedKalmanFilter, ExtraPrior
from estimator.batch import BatchLeastSquares
from estimator.estimate import Estimator
from estimator.extended import ExtendedKalmanFilter
from estimator.image.intrinsics import Intrinsics
from estimator.kalman import KalmanFilter, RadiusPrior, TwistNoise
from estimator.models.cylinder import Cylinder
from estimator.models.limb_plane import LimbPlane
from estimator.models.model import Model
from estimator.models.sphere import Sphere
from estimator.observer import Observer
from estimator.triangulation import Triangulation
from rig.analysis import Analysis, analyse
from rig.background_view import BackgroundView
from rig.build import Rig, build_rig, is_simulated
from rig.config import RigConfig, TargetKind
from rig.deadman import Deadman
from rig.envelope import Envelope
from rig.fusion import Fusion, FusionLog
from rig.given_values import intrinsics_of
from rig.live import View
from rig.log.header import LogHeader
from rig.log.recorder import Recorded
from rig.log.run_log import open_run_log
from rig.loop import RunLoop
from rig.motion import make_controller
from rig.outcome import RunOutcome
from rig.realtime import control_conditions
from rig.recorded.setup import RunSetup, write_setup
from rig.records import Json, write_config
from rig.rehearsal import rehearse
from rig.remarks import delay_facts, tell_remarks
from rig.rolling_shutter import RollingShutter
from rig.run_data import RunData
from rig.safety import Limiter
from rig.servo import servo_figures, servo_task
from rig.summary import summarise
from rig.walls import walls_around


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
    calibration: str = "as configured",
    attachments: tuple[Path, ...] = (),
) -> RunResult:
    """Run once; the arm rests, and everything but the summary is written, when this returns.

    ``calibration`` says where the geometry in ``config`` is from.

    ``attachments`` are put into the log, such as the calibration's file.

    Raises ConnectError when a device cannot be opened; failures during the run are in
    ``outcome.error``.
    """
    rehearse(make_observer(config, target), make_controller(config), target)
    with (
        build_rig(config, target, realtime) as rig,
        open_run_log(run_dir, _header(rig, config, target, attachments), rig.clock) as log,
    ):
        write_config(run_dir, config)
        setup = _setup(rig, target, calibration)
        write_setup(run_dir, setup)
        data = RunData(target=target, T_tool_camera=rig.T_tool_camera)
        # What has to be compiled is compiled here, before time counts.
        fusion = make_fusion(config, target, data, log)
        controller = make_controller(
            config,
            servo_task(config, rig.intrinsics),
            walls_around(config.safety, rig.T_tool_camera, lambda: fusion.state),
        )
        envelope = Envelope(config.safety, rig.T_tool_camera, rig.intrinsics)
        wall: Clock = WallClock()
        wall_start_s = wall.now_s()
        with _conditions(rig, config) as (scheduling, deadman), _shown(view, rig) as shown:
            for remark in tell_remarks(rig.arm):
                log.event(rig.clock.now_s(), "arm's remark", remark)
            shown.begin(setup)
            loop = RunLoop(
                clock=rig.clock,
                arm=rig.arm,
                vision=rig.vision,
                fusion=fusion,
                controller=controller,
                limiter=Limiter(config.safety, envelope),
                config=config,
                data=data,
                log=log,
                stop_requested=stop_requested,
                on_tick=shown.show,
                deadman=deadman,
            )
            outcome = loop.run()
        outcome.stats.scheduling = scheduling
        wall_s = wall.now_s() - wall_start_s
        return _result(rig, outcome, log.close(), config, target, run_dir, wall_s)


def _header(
    rig: Rig, config: RigConfig, target: TargetKind, attachments: tuple[Path, ...]
) -> LogHeader:
    return LogHeader(
        target=target,
        config=config,
        intrinsics=rig.intrinsics,
        T_tool_camera=rig.T_tool_camera,
        realtime=rig.realtime,
        renderer=rig.renderer,
        radius_true_m=None if rig.truth is None else rig.truth.radius_m,
        pictures=not (is_simulated(config) and config.sim.level == "features"),
        offset_ns=time_of_day_offset_ns() if rig.realtime else 0,
        attachments=attachments,
    )


def _setup(rig: Rig, target: TargetKind, calibration: str) -> RunSetup:
    return RunSetup(
        target=target,
        intrinsics=rig.intrinsics,
        T_tool_camera=rig.T_tool_camera,
        radius_true_m=None if rig.truth is None else rig.truth.radius_m,
        renderer=rig.renderer,
        calibration=calibration,
        started_at=local_timestamp(),
    )


def _shown(view: View, rig: Rig) -> View:
    return BackgroundView(view) if rig.realtime else view


@contextmanager
def _conditions(rig: Rig, config: RigConfig) -> Iterator[tuple[str, Deadman | None]]:
    """On the wall clock: priority for the loop, and the deadman, whose thread gets it too."""
    if not rig.realtime:
        yield "simulated time", None
        return
    with (
        control_conditions(config.run.scheduling) as scheduling,
        closing(Deadman(rig.clock, config.arm.hold_s, rig.arm.stop)) as deadman,
    ):
        yield scheduling, deadman


def _result(
    rig: Rig,
    outcome: RunOutcome,
    recorded: Recorded,
    config: RigConfig,
    target: TargetKind,
    run_dir: Path,
    wall_s: float,
) -> RunResult:
    radius_true_m = None if rig.truth is None else rig.truth.radius_m
    analysis = analyse(outcome.data, config, radius_true_m)
    summary = summarise(target, outcome, analysis, config, rig.renderer, wall_s, run_dir)
    summary |= servo_figures(outcome.data, config, rig.intrinsics)
    summary |= _of_log(recorded) | delay_facts(rig.arm)
    return RunResult(summary, outcome, analysis, rig.intrinsics)


def _of_log(recorded: Recorded) -> dict[str, Json]:
    return {
        "log_bytes": recorded.size_bytes,
        "images_recorded": recorded.images,
        "images_not_recorded": recorded.images_dropped,
        "entries_not_recorded": recorded.entries_dropped,
        "log_error": recorded.error or None,
    }


def make_observer(config: RigConfig, target: TargetKind) -> Estimator:
    """The estimator that the configuration asks for; ConfigError where the target has none such."""
    chosen = config.estimator
    model: Model = Sphere() if target == "sphere" else Cylinder()
    kind = chosen.chosen
    if kind in ("limb_plane", "limb_plane_ekf"):
        if target != "sphere":
            raise ConfigError(f"estimator.kind = {kind} is for spheres: choose another")
        model = LimbPlane()
    if kind in ("observer", "limb_plane"):
        return Observer(model, *chosen.gains(target), chosen.radius_guess_m)
    if kind == "triangulation":
        return Triangulation(model, chosen.radius_guess_m)
    prior = RadiusPrior(chosen.radius_guess_m, *chosen.radius_range)
    if kind == "batch":
        return BatchLeastSquares(model, prior)
    noise = TwistNoise(chosen.twist_std_m_s, chosen.twist_std_rad_s)
    if kind == "limb_plane_ekf":
        return ExtendedKalmanFilter(model, prior, noise)
    if chosen.states:
        extra = ExtraPrior(
            chosen.time_offset_std_s if "time_offset" in chosen.states else 0.0,
            chosen.speed_scale_std if "speed_scale" in chosen.states else 0.0,
        )
        return AugmentedKalmanFilter(model, prior, noise, extra, chosen.time_std_s)
    return KalmanFilter(model, prior, noise, chosen.time_std_s)


def make_fusion(config: RigConfig, target: TargetKind, data: RunData, log: FusionLog) -> Fusion:
    """The estimator and what feeds it, as the configuration asks for."""
    # Above the age at which the supervisor calls the states stale, in better words.
    max_extrapolation_s = 2.0 * config.safety.max_state_age_s
    given, lens, shutter = config.calibration, intrinsics_of(config), None
    # A pipe crosses the whole image: on the mean it was seen in the middle of the readout.
    if target == "sphere" and given.row_time_s != 0.0 and lens is not None:
        shutter = RollingShutter(given.row_time_s, lens)
    estimator = make_observer(config, target)
    if isinstance(estimator, AugmentedKalmanFilter):
        data.extra_states = lambda: estimator.extra_states
    return Fusion(estimator, data, log, max_extrapolation_s, given.latency_s, shutter)
