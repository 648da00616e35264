"""How far the fitted unknowns may be off."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration.hand_eye_model import (
    BOARD,
    CAMERA,
    INTRINSICS,
    UNKNOWNS,
    Noise,
    State,
)
from rig.calibration.hand_eye_refine import Problem, bootstrap, pulls, refine

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Deviations:
    """Of every unknown; zero for those that were held."""

    covariance: FloatArray  # (22, 22), of the fit, widened where the bootstrap scatters more
    bootstrap: FloatArray  # (22,) standard deviations


def deviations(
    problem: Problem, state: State, noise: Noise, replicates: int, seed: int
) -> Deviations:
    """From the curvature at the solution and from drawing the views anew: the larger.

    Where distortion coefficients were left out, the shift that fitting them would bring is
    added: a coefficient too small to be noticed still moves the principal point.
    """
    free = problem.free
    pull = pulls(problem, state, noise)
    drawn = bootstrap(pull, replicates, seed)
    # The arm's noise was measured on few poses: what the unknowns took from them is missing.
    poses = 6.0 * len(problem.corners)
    few = poses / max(poses - float(free.sum()), 0.25 * poses)
    own = few * pull.covariance
    ratio = np.maximum(drawn / np.sqrt(np.diag(own)), 1.0)
    covariance, scatter = np.zeros((UNKNOWNS, UNKNOWNS)), np.zeros(UNKNOWNS)
    covariance[np.ix_(free, free)] = own * np.outer(ratio, ratio)
    shift = np.where(free, _shift_by_full_lens(problem, state, noise), 0.0)
    covariance += np.outer(shift, shift)
    scatter[free] = drawn
    return Deviations(covariance, scatter)


def pose_std(T_a_b: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Standard deviations (3,), (3,) of translation and rotation vector of ``T_a_b``.

    ``covariance`` (6, 6) is of the small motion ξ in ``T_a_b exp(ξ)``.
    """
    R = T_a_b[:3, :3]
    shift = R @ covariance[:3, :3] @ R.T
    by_turn = _rotvec_by_turn(se3.rotation_vectors(R))
    turn = by_turn @ covariance[3:, 3:] @ by_turn.T
    return np.sqrt(np.diag(shift)), np.sqrt(np.diag(turn))


def _rotvec_by_turn(rotvec: FloatArray) -> FloatArray:
    """How a rotation vector changes (3, 3) by a small turn of the body in its own axes."""
    angle = float(np.linalg.norm(rotvec))
    if angle < 1e-6:
        return np.eye(3) + 0.5 * se3.cross_matrix(rotvec)
    W = se3.cross_matrix(rotvec / angle)
    half = 0.5 * angle / np.tan(0.5 * angle)
    return np.asarray(np.eye(3) + 0.5 * angle * W + (1.0 - half) * W @ W, dtype=float)


def _shift_by_full_lens(problem: Problem, state: State, noise: Noise) -> FloatArray:
    """By which step (22,) the fit moves when all distortion coefficients are fitted too.

    Nothing when none were left out, or the intrinsics were not fitted to these views.
    """
    lens = problem.free[INTRINSICS]
    if lens.all() or not lens[2] or problem.prior is not None:
        return np.zeros(UNKNOWNS)
    free = problem.free.copy()
    free[INTRINSICS] = True
    full = refine(Problem(problem.T_base_tool, problem.corners, free), state, noise)
    step = np.zeros(UNKNOWNS)
    step[CAMERA] = se3.log(se3.inverse(state.T_tool_camera) @ full.T_tool_camera)
    step[BOARD] = se3.log(se3.inverse(state.T_base_board) @ full.T_base_board)
    step[INTRINSICS] = full.intrinsics - state.intrinsics
    return step
