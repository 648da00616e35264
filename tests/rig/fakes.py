"""A kinematic arm and a camera that sees a sphere exactly, both as faulty as a test wants."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from drivers.clock import Clock
from drivers.errors import RigError
from drivers.interfaces import ArmState, Frame
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig
from rig.config_load import load_config
from rig.envelope import Envelope
from rig.fusion import Fusion
from rig.log.header import LogHeader
from rig.log.run_log import RunLog, open_run_log
from rig.loop import RunLoop
from rig.motion import make_controller
from rig.outcome import LiveStatus, RunOutcome
from rig.records import write_config
from rig.run import make_observer
from rig.run_data import RunData
from rig.safety import Limiter
from rig.vision import Sighting
from sim_backend.clock import SimulatedClock

RADIUS_M = 0.019
P_BASE_M = np.array([0.0, 0.0, 0.3])  # the sphere's centre
STEP_S = 0.002
LATENCY_S = 0.04
FRAME_S = 1.0 / 30.0
INTRINSICS = Intrinsics(800.0, 800.0, 319.5, 239.5)


def looking_down(height_m: float) -> np.ndarray:
    """A camera above the sphere, its z axis down."""
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[:3, 3] = P_BASE_M + np.array([0.0, 0.0, height_m])
    return T


@dataclass
class KinematicArm:
    """Follows commands at once, at 500 Hz, and stops by itself when they run out."""

    clock: Clock
    fail_at_s: float = np.inf  # every call raises from here on
    silent_from_s: float = np.inf  # reports nothing new from here on
    commands: list[tuple[float, np.ndarray]] = field(default_factory=list)
    stops: int = 0
    closed: bool = False
    tcp: np.ndarray | None = None

    def __post_init__(self) -> None:
        self._t_s = self.clock.now_s()
        self._T = looking_down(0.27)
        self._twist = np.zeros(6)
        self._until_s = -np.inf
        self.history: list[ArmState] = []
        self._next = 0

    def read_states(self) -> list[ArmState]:
        self._check()
        self._advance()
        fresh = [s for s in self.history[self._next :] if s.t_s < self.silent_from_s]
        self._next = len(self.history)
        return fresh

    def command_twist(self, twist_tool: np.ndarray, hold_s: float) -> None:
        self._check()
        self._advance()
        self.commands.append((self.clock.now_s(), np.array(twist_tool)))
        self._twist, self._until_s = np.array(twist_tool), self.clock.now_s() + hold_s

    def tcp_offset(self) -> np.ndarray | None:
        return self.tcp

    def stop(self) -> None:
        self._advance()
        self.stops += 1
        self._twist = np.zeros(6)

    def close(self) -> None:
        self.stop()
        self.closed = True

    def pose_at(self, t_s: float) -> np.ndarray:
        self._advance()
        index = int(np.searchsorted([s.t_s for s in self.history], t_s - 1e-9))
        return self.history[min(index, len(self.history) - 1)].T_base_tool

    def _check(self) -> None:
        if self.clock.now_s() >= self.fail_at_s:
            raise ArmBroke("arm: the cable was pulled")

    def _advance(self) -> None:
        while self._t_s <= self.clock.now_s() + 1e-9:
            twist = self._twist if self._t_s < self._until_s else np.zeros(6)
            self.history.append(ArmState(self._t_s, self._T.copy(), twist.copy()))
            R = self._T[:3, :3].copy()
            self._T[:3, 3] += R @ twist[:3] * STEP_S
            self._T[:3, :3] = R @ Rotation.from_rotvec(twist[3:] * STEP_S).as_matrix()
            self._t_s += STEP_S


class ArmBroke(RigError):
    """The error a broken fake raises."""


@dataclass
class ExactVision:
    """Sees the sphere in every frame, ``LATENCY_S`` late, unless a test says otherwise."""

    clock: Clock
    arm: KinematicArm
    hidden: Callable[[float], bool] = lambda t_s: False  # no outline in frames of that instant
    frozen_from_s: float = np.inf  # no frames at all from here on
    error_at_s: float = np.inf
    seq: int = 0

    def poll(self) -> list[Sighting]:
        now_s = self.clock.now_s()
        if now_s >= self.error_at_s:
            raise ArmBroke("camera: unplugged")
        out = []
        while (t_s := self.seq * FRAME_S) + LATENCY_S <= now_s and t_s < self.frozen_from_s:
            out.append(Sighting(self._frame(t_s), self._measure(t_s)))
            self.seq += 1
        return out

    def problem(self) -> str | None:
        return None

    def close(self) -> None:
        pass

    def _frame(self, t_s: float) -> Frame:
        return Frame(np.zeros((480, 640), np.uint8), t_s, 0.0, self.seq, "sim")

    def _measure(self, t_s: float) -> Measurement:
        if self.hidden(t_s):
            return Measurement(None, "hidden by the test")
        T = self.arm.pose_at(t_s)
        s = T[:3, :3].T @ (P_BASE_M - T[:3, 3]) / RADIUS_M
        return Measurement(Feature(s, 1e-10 * np.eye(3)))


@dataclass
class Bench:
    """A loop with fakes all around it."""

    loop: RunLoop
    clock: SimulatedClock
    arm: KinematicArm
    vision: ExactVision
    data: RunData
    config: RigConfig
    run_dir: Path
    log: RunLog

    def run(self) -> RunOutcome:
        """Run the loop; the log is in its file when this returns."""
        with self.log:
            return self.loop.run()


def make_bench(
    run_dir: Path,
    assignments: list[str] | None = None,
    stop_requested: Callable[[SimulatedClock], bool] = lambda clock: False,
    on_tick: Callable[[LiveStatus], None] = lambda status: None,
) -> Bench:
    """The paper's observer of a sphere around the fakes; the camera is the tool."""
    settings = ["log.images=off", "estimator.kind=observer", *(assignments or [])]
    config = load_config("sphere", None, settings)
    clock = SimulatedClock()
    arm = KinematicArm(clock)
    vision = ExactVision(clock, arm)
    data = RunData("sphere", np.eye(4))
    write_config(run_dir, config)
    log = open_run_log(run_dir, LogHeader("sphere", config, INTRINSICS, np.eye(4), False), clock)
    fusion = Fusion(make_observer(config, "sphere"), data, log, 2.0 * config.safety.max_state_age_s)
    loop = RunLoop(
        clock=clock,
        arm=arm,
        vision=vision,
        fusion=fusion,
        controller=make_controller(config),
        limiter=Limiter(config.safety, Envelope(config.safety, np.eye(4), INTRINSICS)),
        config=config,
        data=data,
        log=log,
        stop_requested=lambda: stop_requested(clock),
        on_tick=on_tick,
    )
    return Bench(loop, clock, arm, vision, data, config, run_dir, log)
