"""One calibration from the first look to the file: collect, fit, verify, judge."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from drivers.clock import local_timestamp
from drivers.interfaces import GreyImage
from rig.calibration.board import corner_points
from rig.calibration.detection import BoardDetector, Detection
from rig.calibration.errors import CalibrationError
from rig.calibration.excitation import Excitation
from rig.calibration.latency import LatencyFit
from rig.calibration.pose_candidates import Scene
from rig.calibration.pose_planning import plan_poses
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
from rig.calibration_run.bench import Bench
from rig.calibration_run.by_hand import ByHand, Glance, KeySource
from rig.calibration_run.checking import SMALL_MOTIONS, fresh_stills, small_motions
from rig.calibration_run.collector import Collector, nominal_state, within_safety
from rig.calibration_run.fits import Geometry, Verification, fit_delay, fit_geometry, verify
from rig.calibration_run.hand_jog import HandJog
from rig.calibration_run.mover import Mover
from rig.calibration_run.onlooker import Onlooker
from rig.calibration_run.recording import Recording, record
from rig.calibration_run.stills import Photographer
from rig.calibration_run.store import Store
from rig.calibration_run.watching import Progress, Stop
from rig.config import RigConfig
from rig.start_values import start_doubt

_VERIFY_SEED = 1000  # other poses than those the fit has seen


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
        stop: Stop,
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
        self._stop = stop
        self._detector = BoardDetector(calibration.board)
        self._mover = Mover(
            bench.arm,
            bench.clock,
            config.safety,
            config.arm.hold_s,
            stop,
            self._plan.speed,
            bench.T_tool_camera,
            bench.deadman,
        )
        self._photographer = Photographer(bench.camera, self._mover, self._detect, bench.clock)
        limits = within_safety(self._plan.limits, config.safety)
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
            self._plan.hand_eye.min_poses,
            start_doubt(self._plan.doubt, bool(bench.assumed)),
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
        wanted, stills = self._plan.poses, self._store.stills
        self._progress.step("poses", f"{len(stills)} of {wanted} are there", wanted)
        if not stills:
            self._store.add_still(self._collector.first_look())
        elif len(stills) < wanted:
            self._collector.check_place(stills[0])
        taken = self._collector.collect(list(stills), wanted)
        if len(taken) < wanted:
            self._progress.note(
                f"only {len(taken)} of {wanted} poses: {len(self._collector.skipped)} were skipped"
            )

    def collect_by_hand(self, keys: KeySource, show: Callable[[Glance], None]) -> None:
        """Take stills where a person brings the arm, at every key; see ``ByHand``."""
        bench, mover, start = self._bench, self._mover, self._collector.state
        jog = HandJog(mover, start.T_tool_camera) if bench.moves else None
        stand = mover if bench.moves else Onlooker(bench.arm, bench.clock, self._stop)
        hand = ByHand(
            bench.camera,
            Photographer(bench.camera, stand, self._detect, bench.clock),
            self._detect,
            bench.intrinsics,
            jog,
            self._store,
            self._plan.hand_eye.min_poses,
            self._plan.poses,
        )
        hand.run(keys, show, mover.check_stop)

    def fit(self) -> Geometry:
        """Intrinsics and hand-eye from all stills; raises CalibrationError."""
        self._progress.step("fit", f"intrinsics and hand-eye from {len(self._store.stills)} stills")
        with self._stop.at_once():
            geometry = fit_geometry(
                self._store.stills, self._board, self._plan.hand_eye, self.file.pictures
            )
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
        geometry = self.geometry or self.fit()
        if self._store.recording is None:
            self._store.set_recording(self._record(geometry))
        recording = self._store.recording
        assert recording is not None  # either it was there or it was made
        self._progress.step("fit", "latency")
        try:
            with self._stop.at_once():
                self.latency = fit_delay(recording, geometry, self._plan.rolling_shutter)
        except CalibrationError:
            self._store.drop_recording()  # the same again would fail again
            raise
        self._save(latency=latency_result(self.latency, self._depends_on))
        return self.latency

    def check(self) -> Verification:
        """Small motions along and about each axis, and fresh poses; raises CalibrationError."""
        geometry, wanted = self.geometry or self.fit(), self._plan.verify_poses
        mover, photographer, progress = self._mover, self._photographer, self._progress
        first = self._store.stills[0]
        progress.step("verification", "small motions", SMALL_MOTIONS)
        wiggles = small_motions(mover, photographer, first.view.T_base_tool, progress.done)
        progress.step("verification", "fresh poses", wanted)
        size = (first.image.shape[1], first.image.shape[0])
        scene = Scene(geometry.state, corner_points(self._board), size, first.view.T_base_tool)
        # Some may be refused: a few more than are needed.
        poses = plan_poses(
            scene, 2 * wanted + 2, self._limits, reachable=mover.routes(), seed=_VERIFY_SEED
        )
        stills = fresh_stills(mover, photographer, poses[::-1], wanted, progress.pose)
        self.verification = verify(stills, wiggles, geometry)
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

    def _record(self, geometry: Geometry) -> Recording:
        plan, bench = self._plan, self._bench
        detail = f"{plan.segments} wiggles of {plan.segment_s:g} s"
        self._progress.step("latency", detail, plan.segments)
        self._mover.go_to(self._store.stills[0].view.T_base_tool)
        return record(
            bench.camera,
            self._mover,
            bench.clock,
            self._detect_quickly,
            [Excitation(plan.segment_s, seed=k + 1) for k in range(plan.segments)],
            geometry.hand_eye.T_tool_camera,
            self._progress,
        )

    def _detect(self, image: GreyImage) -> BoardView:
        return _view(self._detector.find(image))

    def _detect_quickly(self, image: GreyImage) -> BoardView:
        """For hundreds of moving pictures, where blur is what limits."""
        return _view(self._detector.find(image, fine=False))

    def _named(self, *names: str) -> Fingerprints:
        return {name: self._depends_on[name] for name in names if name in self._depends_on}

    def _save(self, **sections: object) -> None:
        """Put sections into the file; a verdict on what was there before no longer holds."""
        self._mover.check_stop()
        cleared = {} if "verdict" in sections else {"verdict": None}
        self.file = self.file.model_copy(update={"made": local_timestamp(), **cleared, **sections})
        save_calibration(self.file, self._path)


def _view(found: Detection) -> BoardView:
    if found.view is None:
        raise CalibrationError(found.reason)
    return found.view
