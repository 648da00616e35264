"""Looks at the board from many poses: each planned from what is known so far, bad ones skipped."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.calibration.board_pose import board_pose
from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye import HandEyeSettings, solve_hand_eye
from rig.calibration.hand_eye_model import State
from rig.calibration.intrinsics import fit_intrinsics
from rig.calibration.pose_candidates import PoseLimits, Scene, StartDoubt
from rig.calibration.pose_planning import PlannedPose, plan_poses, tour
from rig.calibration.projection import from_vector, to_vector
from rig.calibration_run.errors import PoseRefusedError
from rig.calibration_run.mover import Mover
from rig.calibration_run.stills import Photographer, Still

FloatArray = NDArray[np.float64]

_FIRST = 8  # poses of the first round, planned with nominal values
_REFINED = StartDoubt(tool_camera_m=0.002, tool_camera_rad=0.01, focal=0.005)
_MOST_ROUNDS = 5


@dataclass(frozen=True, slots=True)
class PoseReport:
    """What became of one planned pose, for whoever watches."""

    number: int  # of the pose, from 1
    wanted: int
    pose: PlannedPose
    problem: str  # why it was skipped, or ""


class Collector:
    """Collects stills from planned poses, starting where the arm stands.

    ``nominal`` holds the values to start with; its board pose is replaced by what the first
    look shows. ``keep`` is called with every still as it is taken.
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
        self._seed = seed
        self.skipped: list[str] = []

    def first_look(self) -> Still:
        """A still from where the arm stands; raises CalibrationError when it shows no board."""
        try:
            return self._photographer.take()
        except CalibrationError as error:
            raise CalibrationError(
                f"the first look shows no usable board: {error}. Jog the arm until the whole "
                "board is in the middle of the image, then start again"
            ) from error

    def collect(self, stills: Sequence[Still], wanted: int) -> list[Still]:
        """``stills``, at least the first look, and as many further ones as are ``wanted`` in all.

        A pose that is refused or shows too little is skipped. Raises CalibrationError when the
        plan finds no more poses before there are enough for a fit.
        """
        taken = list(stills)
        size = (taken[0].image.shape[1], taken[0].image.shape[0])
        for round_number in range(_MOST_ROUNDS):
            if len(taken) >= wanted:
                break
            doubt = self._improve(taken, size)
            count = min(wanted, _FIRST) if doubt is None else wanted
            scene = Scene(self._state, self._points_m, size, taken[0].view.T_base_tool)
            poses = plan_poses(
                scene,
                max(count - len(taken), 1),
                self._limits,
                doubt,
                [still.view.T_base_tool for still in taken],
                seed=self._seed + round_number,
            )
            for pose in tour(poses, self._mover.T_base_tool):
                self._visit(pose, taken, wanted)
        return taken

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
        """Better values to plan with, once there are enough stills; None: there are none yet."""
        if len(taken) < _FIRST:
            self._place_board(taken[0])
            return None
        try:
            lens = fit_intrinsics([still.view.board for still in taken], size)
            fit = solve_hand_eye(
                [still.view for still in taken],
                lens.intrinsics,
                lens.model,
                self._square_m,
                HandEyeSettings(bootstrap=50, min_poses=_FIRST),
            )
        except CalibrationError:
            self._place_board(taken[0])  # more poses will tell; the final fit says what is wrong
            return None
        self._state = replace(
            self._state,
            T_tool_camera=fit.T_tool_camera,
            T_base_board=fit.T_base_board,
            intrinsics=to_vector(fit.intrinsics),
        )
        return _REFINED

    def _place_board(self, still: Still) -> None:
        T_camera_board = board_pose(still.view.board, from_vector(self._state.intrinsics))
        T_base_camera = still.view.T_base_tool @ self._state.T_tool_camera
        self._state = replace(self._state, T_base_board=T_base_camera @ T_camera_board)


def nominal_state(T_tool_camera: FloatArray, intrinsics: FloatArray) -> State:
    """The values a calibration starts from; the board's place is not known yet."""
    return State(T_tool_camera, np.eye(4), intrinsics)
