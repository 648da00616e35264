"""Looks at the board from many poses: each planned from what is known so far, bad ones skipped."""

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration.board_pose import board_pose
from rig.calibration.errors import CalibrationError, ScaleError
from rig.calibration.hand_eye import HandEyeSettings, solve_hand_eye
from rig.calibration.hand_eye_model import State
from rig.calibration.intrinsics import fit_intrinsics
from rig.calibration.pose_candidates import PoseLimits, Scene, StartDoubt
from rig.calibration.pose_planning import PlannedPose, plan_poses, tour
from rig.calibration.projection import from_vector, to_vector
from rig.calibration.rough_scale import check_rough_scale
from rig.calibration_run.errors import FewPicturesError, PoseRefusedError
from rig.calibration_run.mover import Mover
from rig.calibration_run.same_place import why_moved
from rig.calibration_run.stills import Photographer, Still
from rig.calibration_run.watching import PoseReport
from rig.config_safety import SafetyConfig

FloatArray = NDArray[np.float64]

FIRST = 8  # poses of the first round, planned with nominal values
REFINED = StartDoubt(tool_camera_m=0.002, tool_camera_rad=0.01, focal=0.005)
_MOST_ROUNDS = 6
# A board's size this far from the claimed one is clear from a handful of stills.
_CLEARLY_WRONG_SIZE = 0.02
_ASIDE_M = 0.05
_TIMID = 0.6  # of the angles, after a round in which most poses did not show the board


class Collector:
    """Collects stills from planned poses, starting where the arm stands.

    ``nominal`` holds the values to start with; its board pose is replaced by what the first
    look shows. ``keep`` is called with every still as it is taken. Fewer than ``needed`` stills
    are good for nothing. ``doubt`` is how far ``nominal`` may be off.
    """

    def __init__(
        self,
        mover: Mover,
        photographer: Photographer,
        nominal: State,
        points_m: FloatArray,
        limits: PoseLimits,
        square_m: float,
        keep: Callable[[Still], None],
        report: Callable[[PoseReport], None],
        needed: int,
        doubt: StartDoubt,
        seed: int = 1,
    ) -> None:
        self._mover = mover
        self._photographer = photographer
        self._state = nominal
        self._points_m = points_m
        self._limits = limits
        self._square_m = square_m
        self._keep = keep
        self._report = report
        self._needed = needed
        self._doubt = doubt
        self._seed = seed
        self.skipped: list[str] = []

    def first_look(self) -> Still:
        """A still from where the arm stands; raises CalibrationError when it shows no board."""
        try:
            return self._photographer.take()
        except FewPicturesError:
            raise
        except CalibrationError as error:
            raise CalibrationError(
                f"the first look shows no usable board: {error}. Jog the arm until the whole "
                "board is in the middle of the image, then start again"
            ) from error

    def check_place(self, first: Still) -> None:
        """Go where the first still was taken; raises CalibrationError when the board moved."""
        self._mover.go_to(first.view.T_base_tool)
        why = why_moved(first.view, self.first_look().view, self._state)
        if why:
            raise CalibrationError(why)

    def collect(self, stills: Sequence[Still], wanted: int) -> list[Still]:
        """``stills``, at least the first look, and as many further ones as are ``wanted`` in all.

        A pose that is refused or shows too little is skipped; after a round of mostly such
        poses the next ones are nearer to the first look. May return fewer than are wanted.
        Raises CalibrationError when there are too few for a fit, ScaleError as soon as it is
        clear that the board's size is wrong.
        """
        taken, no_plan = list(stills), ""
        for round_number in range(_MOST_ROUNDS):
            if len(taken) >= wanted:
                break
            try:
                poses = self._plan(taken, wanted, round_number)
            except CalibrationError as error:
                if isinstance(error, ScaleError):
                    raise
                no_plan = str(error)
                break
            before = len(taken)
            for pose in tour(poses, self._mover.T_base_tool):
                self._visit(pose, taken, wanted)
            if len(taken) - before < 0.5 * len(poses):
                if round_number == 0:
                    self._check_size(taken)
                self._be_timid(taken[0])
        if len(taken) < min(self._needed, wanted):
            raise CalibrationError(self._why_too_few(len(taken), no_plan))
        return taken

    def _plan(self, taken: Sequence[Still], wanted: int, round_number: int) -> list[PlannedPose]:
        size = (taken[0].image.shape[1], taken[0].image.shape[0])
        doubt = self._improve(taken, size)
        count = min(wanted, FIRST) if doubt is None else wanted
        return plan_poses(
            Scene(self._state, self._points_m, size, taken[0].view.T_base_tool),
            max(count - len(taken), 1),
            self._limits,
            doubt or self._doubt,
            [still.view.T_base_tool for still in taken],
            self._mover.routes(),
            seed=self._seed + round_number,
        )

    def _check_size(self, taken: Sequence[Still]) -> None:
        """Look from two places close by: why did most poses not show the board?

        Raises ScaleError when its size is far from the claimed one.
        """
        first, views = taken[0].view, [still.view for still in taken]
        X = self._state.T_tool_camera
        for side_m in (-_ASIDE_M, _ASIDE_M):
            beside = X @ se3.exp(np.array([side_m, 0.0, 0.0, 0.0, 0.0, 0.0])) @ se3.inverse(X)
            with suppress(PoseRefusedError, CalibrationError):
                self._mover.go_to(first.T_base_tool @ beside)
                views.append(self._photographer.take().view)
        check_rough_scale(views, self._state, self._square_m)

    def _be_timid(self, first: Still) -> None:
        """Nearer to where the board was seen to be: something that is planned with is wrong."""
        limits = self._limits
        T_camera_board = board_pose(first.view.board, from_vector(self._state.intrinsics))
        away_m = float(np.linalg.norm(T_camera_board[:3, 3]))
        changed = {
            name: away_m + _TIMID * (getattr(limits, name) - away_m)
            for name in ("min_distance_m", "max_distance_m")
        }
        for name in ("max_tilt_rad", "max_spin_rad", "max_turn_rad"):
            changed[name] = _TIMID * getattr(limits, name)
        self._limits = limits.model_copy(update=changed)

    def _why_too_few(self, count: int, no_plan: str) -> str:
        text = f"only {count} poses show the board, {self._needed} are needed"
        if self.skipped:
            reason, times = Counter(self.skipped).most_common(1)[0]
            text += f"; {len(self.skipped)} were skipped, {times} of them because: {reason}"
        if no_plan:
            text += f"; no more can be planned: {no_plan}"
        return text + ". Start with the board in the middle of the image and room around the arm"

    @property
    def state(self) -> State:
        """What is known so far of camera and board."""
        return self._state

    def _visit(self, pose: PlannedPose, taken: list[Still], wanted: int) -> None:
        problem = ""
        try:
            self._mover.go_to(pose.T_base_tool)
            still = self._photographer.take()
        except (PoseRefusedError, CalibrationError) as error:
            problem = str(error)
            self.skipped.append(problem)
        else:
            taken.append(still)
            self._keep(still)
        self._report(PoseReport(len(taken), wanted, pose, problem))

    def _improve(self, taken: Sequence[Still], size: tuple[int, int]) -> StartDoubt | None:
        """Better values to plan with, once there are enough stills; None: there are none yet.

        Raises ScaleError when they contradict the board's size beyond doubt.
        """
        if len(taken) < FIRST:
            self._place_board(taken[0])
            return None
        try:
            lens = fit_intrinsics([still.view.board for still in taken], size)
            fit = solve_hand_eye(
                [still.view for still in taken],
                lens.intrinsics,
                lens.model,
                self._square_m,
                HandEyeSettings(bootstrap=50, min_poses=FIRST, scale_tolerance=_CLEARLY_WRONG_SIZE),
            )
        except ScaleError:
            raise
        except CalibrationError:
            self._place_board(taken[0])  # more poses will tell; the final fit says what is wrong
            return None
        self._state = replace(
            self._state,
            T_tool_camera=fit.T_tool_camera,
            T_base_board=fit.T_base_board,
            intrinsics=to_vector(fit.intrinsics),
        )
        return REFINED

    def _place_board(self, still: Still) -> None:
        T_camera_board = board_pose(still.view.board, from_vector(self._state.intrinsics))
        T_base_camera = still.view.T_base_tool @ self._state.T_tool_camera
        self._state = replace(self._state, T_base_board=T_base_camera @ T_camera_board)


def nominal_state(T_tool_camera: FloatArray, intrinsics: FloatArray) -> State:
    """The values a calibration starts from; the board's place is not known yet."""
    return State(T_tool_camera, np.eye(4), intrinsics)


def within_safety(limits: PoseLimits, safety: SafetyConfig) -> PoseLimits:
    """The limits with the workspace that the rig's safety allows."""
    box = {"workspace_min_m": safety.workspace_min_m, "workspace_max_m": safety.workspace_max_m}
    return limits.model_copy(update=box)
