"""One calibration from the first look to the file: collect, fit, verify, judge."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import local_timestamp
from drivers.interfaces import GreyImage
from rig.calibration import se3
from rig.calibration.board import corner_points
from rig.calibration.detection import BoardDetector, Detection
from rig.calibration.errors import CalibrationError
from rig.calibration.excitation import Excitation
from rig.calibration.latency import LatencyFit
from rig.calibration.pose_candidates import Scene
from rig.calibration.pose_planning import plan_poses, tour
from rig.calibration.projection import to_vector
from rig.calibration.result import CalibrationFile, Fingerprints, save_calibration
from rig.calibration.result_check import judge
from rig.calibration.result_make import (
    hand_eye_result,
    intrinsics_result,
    latency_result,
    verification_result,
)
from rig.calibration.views import BoardView
from rig.calibration.wiggle import Wiggle, wiggle_steps
from rig.calibration_run.bench import Bench
from rig.calibration_run.collector import Collector, PoseReport, nominal_state
from rig.calibration_run.errors import PoseRefusedError
from rig.calibration_run.fits import Geometry, Verification, fit_delay, fit_geometry, verify
from rig.calibration_run.mover import Mover
from rig.calibration_run.recording import record
from rig.calibration_run.stills import Photographer, Still
from rig.calibration_run.store import Store
from rig.config import RigConfig

FloatArray = NDArray[np.float64]

_VERIFY_SEED = 1000  # other poses than those the fit has seen


class Progress(Protocol):
    """Whoever watches a calibration."""

    def step(self, name: str, detail: str) -> None:
        """A step begins."""
        ...

    def pose(self, report: PoseReport) -> None:
        """A planned pose was looked from, or skipped."""
        ...


class Session:
    """The steps of a calibration on one bench; each adds its section to ``file`` and saves it.

    ``depends_on`` fingerprints what the result holds for.
    """

    def __init__(
        self,
        config: RigConfig,
        bench: Bench,
        store: Store,
        path: Path,
        before: CalibrationFile | None,
        depends_on: Fingerprints,
        progress: Progress,
        stop_requested: Callable[[], bool],
    ) -> None:
        calibration = config.calibration
        self._plan = calibration.plan
        self._board = calibration.board
        self._required = calibration.required
        self._bench = bench
        self._store = store
        self._path = path
        self._depends_on = depends_on
        self._progress = progress
        self._detector = BoardDetector(calibration.board)
        self._mover = Mover(
            bench.arm,
            bench.clock,
            config.safety,
            config.arm.hold_s,
            stop_requested,
            self._plan.speed,
        )
        self._photographer = Photographer(bench.camera, self._mover, self._detect, bench.clock)
        limits = self._plan.limits.model_copy(
            update={
                "workspace_min_m": config.safety.workspace_min_m,
                "workspace_max_m": config.safety.workspace_max_m,
            }
        )
        self._limits = limits
        self._collector = Collector(
            self._mover,
            self._photographer,
            nominal_state(bench.T_tool_camera, to_vector(bench.intrinsics)),
            corner_points(self._board),
            limits,
            self._board.square_m,
            store.add_still,
            progress.pose,
        )
        self.file = before or CalibrationFile(
            rig=config.name, made=local_timestamp(), board=self._board
        )
        self.geometry: Geometry | None = None
        self.latency: LatencyFit | None = None
        self.verification: Verification | None = None

    @property
    def delay_s(self) -> tuple[float, float]:
        """From a picture's stamp to the program's having it: mean and its standard deviation.

        Both nan before a recording.
        """
        recording = self._store.recording
        delays_s = np.zeros(0) if recording is None else recording.delays_s
        if len(delays_s) < 2:
            return float("nan"), float("nan")
        return float(delays_s.mean()), float(delays_s.std(ddof=1) / np.sqrt(len(delays_s)))

    def collect(self) -> None:
        """Look at the board from as many poses as are planned, or as are still missing."""
        wanted = self._plan.poses
        self._progress.step("poses", f"{len(self._store.stills)} of {wanted} are there")
        if not self._store.stills:
            self._store.add_still(self._collector.first_look())
        self._collector.collect(list(self._store.stills), wanted)

    def fit(self) -> Geometry:
        """Intrinsics and hand-eye from all stills; raises CalibrationError."""
        self._progress.step("fit", f"{len(self._store.stills)} stills")
        geometry = fit_geometry(self._store.stills, self._board, self._plan.hand_eye)
        height, width = self._store.stills[0].image.shape[:2]
        hand_eye = geometry.hand_eye
        self.geometry = geometry
        self._save(
            intrinsics=intrinsics_result(
                geometry.lens, (width, height), self._named("camera", "board"), hand_eye
            ),
            hand_eye=hand_eye_result(hand_eye, self._depends_on),
        )
        return geometry

    def measure_latency(self) -> LatencyFit:
        """Wiggle in front of the board and fit; raises CalibrationError."""
        geometry, plan = self.geometry or self.fit(), self._plan
        if self._store.recording is None:
            self._progress.step("latency", f"{plan.segments} wiggles of {plan.segment_s:g} s")
            self._mover.go_to(self._store.stills[0].view.T_base_tool)
            motions = [Excitation(plan.segment_s, seed=k + 1) for k in range(plan.segments)]
            self._store.set_recording(
                record(
                    self._bench.camera,
                    self._mover,
                    self._bench.clock,
                    self._detect_quickly,
                    motions,
                    geometry.hand_eye.T_tool_camera,
                )
            )
        recording = self._store.recording
        assert recording is not None  # either it was there or it was made
        try:
            self.latency = fit_delay(recording, geometry)
        except CalibrationError:
            self._store.drop_recording()  # the same again would fail again
            raise
        self._save(latency=latency_result(self.latency, self._depends_on))
        return self.latency

    def check(self) -> Verification:
        """Small motions along and about each axis, and fresh poses; raises CalibrationError."""
        geometry = self.geometry or self.fit()
        self._progress.step("verification", "small motions, then fresh poses")
        wiggles = self._wiggle()
        self.verification = verify(self._fresh(geometry), wiggles, geometry)
        self._save(
            verification=verification_result(
                self.verification.wiggles, self._depends_on, self.verification.error.px
            )
        )
        return self.verification

    def conclude(self) -> CalibrationFile:
        """Judge the file as it is now, and save it with the verdict."""
        self._save(verdict=judge(self.file, self._required))
        return self.file

    def _wiggle(self) -> list[Wiggle]:
        home = self._store.stills[0].view.T_base_tool
        wiggles = []
        for axis, step in enumerate(wiggle_steps()):
            self._mover.go_to(home)
            before = self._photographer.take()
            self._mover.go_to(home @ se3.exp(step))
            wiggles.append(Wiggle(axis, before.view, self._photographer.take().view))
        self._mover.go_to(home)
        return wiggles

    def _fresh(self, geometry: Geometry) -> list[Still]:
        first = self._store.stills[0]
        size = (first.image.shape[1], first.image.shape[0])
        scene = Scene(geometry.state, corner_points(self._board), size, first.view.T_base_tool)
        wanted = self._plan.verify_poses
        # Some may be refused: a few more than are needed.
        poses = plan_poses(scene, 2 * wanted + 2, self._limits, seed=_VERIFY_SEED)[::-1]
        stills: list[Still] = []
        for pose in tour(poses, self._mover.T_base_tool):
            if len(stills) == wanted:
                break
            try:
                self._mover.go_to(pose.T_base_tool)
                stills.append(self._photographer.take())
            except (PoseRefusedError, CalibrationError) as error:
                self._progress.pose(PoseReport(len(stills), wanted, pose, str(error)))
            else:
                self._progress.pose(PoseReport(len(stills), wanted, pose, ""))
        if not stills:
            raise CalibrationError("no fresh pose showed the board: widen calibration.plan.limits")
        return stills

    def _detect(self, image: GreyImage) -> BoardView:
        return _view(self._detector.find(image))

    def _detect_quickly(self, image: GreyImage) -> BoardView:
        """For hundreds of moving pictures, where blur is what limits."""
        return _view(self._detector.find(image, fine=False))

    def _named(self, *names: str) -> Fingerprints:
        return {name: self._depends_on[name] for name in names if name in self._depends_on}

    def _save(self, **sections: object) -> None:
        """Put sections into the file; a verdict on what was there before no longer holds."""
        cleared = {} if "verdict" in sections else {"verdict": None}
        self.file = self.file.model_copy(update={"made": local_timestamp(), **cleared, **sections})
        save_calibration(self.file, self._path)


def _view(found: Detection) -> BoardView:
    if found.view is None:
        raise CalibrationError(found.reason)
    return found.view
