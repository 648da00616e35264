"""Where the camera sits on the tool, from views of a board that stands still."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimator.image.intrinsics import Intrinsics
from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye_checks import check_noise, check_rotations, check_scale
from rig.calibration.hand_eye_held_out import HeldOutError, held_out_error
from rig.calibration.hand_eye_model import BOARD, CAMERA, INTRINSICS, UNKNOWNS, Noise, linearise
from rig.calibration.hand_eye_refine import Prior, Problem
from rig.calibration.hand_eye_robust import agreeing_views, fit_with_noise, std_of_scale
from rig.calibration.hand_eye_start import start_state
from rig.calibration.hand_eye_std import deviations, pose_std
from rig.calibration.lens_model import LensModel
from rig.calibration.projection import from_vector, to_vector
from rig.calibration.views import PosedView, stack
from rig.config_section import NotNegative, Section

FloatArray = NDArray[np.float64]

# What a run uses; the board is only there for calibrating.
_RIG = np.r_[CAMERA, INTRINSICS]


class HandEyeSettings(Section):
    """How the hand-eye transform is fitted and judged."""

    min_poses: Annotated[int, Field(ge=5)] = 8
    held_out_share: Annotated[float, Field(gt=0, lt=0.6)] = 0.2
    # Which intrinsics are refined together with the hand-eye transform.
    refine: Literal["all", "focal", "none"] = "all"
    bootstrap: Annotated[int, Field(ge=50, le=100_000)] = 500
    # A ratio of the board's size further from 1 than this, and clearly so, is an error.
    scale_tolerance: NotNegative = 0.005
    seed: Annotated[int, Field(ge=0)] = 1


@dataclass(frozen=True, slots=True)
class HandEyeFit:
    """The hand-eye transform and how far to trust it.

    Standard deviations are the larger of the fit's own and the bootstrap's.
    """

    T_tool_camera: FloatArray  # (4, 4)
    std_xyz_m: FloatArray  # (3,) of the translation, tool axes
    std_rotvec_rad: FloatArray  # (3,) of the components of the rotation vector
    bootstrap_xyz_m: FloatArray  # (3,)
    bootstrap_rotvec_rad: FloatArray  # (3,)
    covariance: FloatArray  # (6, 6) of a small motion of the camera in its own axes
    joint_covariance: FloatArray  # (15, 15) of that and the intrinsics together
    T_base_board: FloatArray  # (4, 4)
    board_covariance: FloatArray  # (6, 6) of a small motion of the board in its own axes
    intrinsics: Intrinsics  # refined
    intrinsics_std: FloatArray  # (9,)
    noise: Noise  # of corners and arm, as measured
    scale: float  # the board's size by the arm's motion over the claimed one
    scale_std: float
    fit_px: float  # rms distance of the fitted views' corners
    held_out: HeldOutError
    used: NDArray[np.intp]  # numbers of the views fitted
    held_out_views: NDArray[np.intp]  # numbers of the views never fitted
    rejected: dict[int, str]  # number of the view and why
    per_view_px: FloatArray  # rms distance of every view's corners, used or not
    start: str  # the closed form that the fit began with


def solve_hand_eye(
    views: Sequence[PosedView],
    intrinsics: Intrinsics,
    lens: LensModel,
    square_m: float,
    settings: HandEyeSettings | None = None,
    prior_covariance: FloatArray | None = None,
) -> HandEyeFit:
    """T_tool_camera (4, 4) from at least ``settings.min_poses`` views with arm poses.

    ``intrinsics`` start the refinement; ``lens`` says which distortion coefficients it may
    change. ``prior_covariance`` (9, 9) is for intrinsics from *other* images than these; from
    the same images it would count them twice. Every fifth view is held out of the fit and
    judges it. Raises CalibrationError with the motion that is missing, the ratio of a wrong
    board size, or why too few poses agree.
    """
    settings = settings or HandEyeSettings()
    if len(views) < settings.min_poses:
        raise CalibrationError(
            f"{len(views)} poses with the board in view, {settings.min_poses} are needed: "
            f"add {settings.min_poses - len(views)} or more"
        )
    problem = _problem(views, intrinsics, lens, settings, prior_covariance)
    held = _held_out(len(views), settings.held_out_share)
    fitted = np.setdiff1d(np.arange(len(views)), held)
    check_rotations(problem.T_base_tool[fitted])
    boards = [views[i].board for i in fitted]
    start, state = start_state(problem.T_base_tool[fitted], boards, intrinsics)
    used, rejected, state, noise = agreeing_views(problem, fitted, state)
    check_rotations(problem.T_base_tool[used])
    own = problem.only(used)
    check_noise(noise)
    scale, scale_std = state.scale, std_of_scale(own, state, noise)
    check_scale(scale, scale_std, square_m, settings.scale_tolerance)
    state, noise = fit_with_noise(own, replace(state, scale=1.0), noise)
    spread = deviations(own, state, noise, settings.bootstrap, settings.seed)
    std_xyz_m, std_rotvec_rad = pose_std(state.T_tool_camera, spread.covariance[CAMERA, CAMERA])
    drawn = np.diag(spread.bootstrap[CAMERA] ** 2)
    drawn_xyz_m, drawn_rotvec_rad = pose_std(state.T_tool_camera, drawn)
    off = linearise(state, problem.T_base_tool, problem.corners).residuals
    corners = problem.corners.seen.sum(axis=1)
    return HandEyeFit(
        T_tool_camera=state.T_tool_camera,
        std_xyz_m=std_xyz_m,
        std_rotvec_rad=std_rotvec_rad,
        bootstrap_xyz_m=drawn_xyz_m,
        bootstrap_rotvec_rad=drawn_rotvec_rad,
        covariance=spread.covariance[CAMERA, CAMERA],
        joint_covariance=spread.covariance[np.ix_(_RIG, _RIG)],
        T_base_board=state.T_base_board,
        board_covariance=spread.covariance[BOARD, BOARD],
        intrinsics=from_vector(state.intrinsics),
        intrinsics_std=np.sqrt(np.diag(spread.covariance)[INTRINSICS]),
        noise=noise,
        scale=scale,
        scale_std=scale_std,
        fit_px=float(np.sqrt(np.sum(off[used] ** 2) / np.sum(corners[used]))),
        held_out=held_out_error([views[i] for i in held], state),
        used=used,
        held_out_views=held,
        rejected=rejected,
        per_view_px=np.sqrt(np.sum(off**2, axis=1) / corners),
        start=start,
    )


def _problem(
    views: Sequence[PosedView],
    intrinsics: Intrinsics,
    lens: LensModel,
    settings: HandEyeSettings,
    prior_covariance: FloatArray | None,
) -> Problem:
    free = np.zeros(UNKNOWNS, dtype=bool)
    free[CAMERA] = free[BOARD] = True
    if settings.refine == "all":
        free[INTRINSICS] = lens.free
    elif settings.refine == "focal":
        free[INTRINSICS.start : INTRINSICS.start + 2] = True
    prior = None if prior_covariance is None else Prior(to_vector(intrinsics), prior_covariance)
    return Problem(
        np.array([view.T_base_tool for view in views]),
        stack([view.board for view in views]),
        free,
        prior,
    )


def _held_out(count: int, share: float) -> NDArray[np.intp]:
    """Numbers of the views to hold out, spread evenly over the session; never the first."""
    wanted = max(2, round(share * count))
    return np.unique(np.round((np.arange(wanted) + 1) * count / wanted).astype(np.intp) - 1)
