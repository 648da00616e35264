"""The fit of the views that agree with each other, with the noise that was found in them."""

import numpy as np
from numpy.typing import NDArray

from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye_model import SCALE, Noise, State, linearise
from rig.calibration.hand_eye_noise import measured_noise
from rig.calibration.hand_eye_outliers import misfits
from rig.calibration.hand_eye_refine import Problem, pulls, refine

_FIRST_NOISE = Noise(0.2, 5e-4, 1e-3)
_REJECTIONS = 4  # rounds of leaving out poses that contradict the rest
_MAX_LOST = 0.3  # of the poses


def fit_with_noise(problem: Problem, state: State, noise: Noise) -> tuple[State, Noise]:
    """Fit and noise, each by turns from the other, near ``state``."""
    for _ in range(2):
        state = refine(problem, state, noise)
        linear = linearise(state, problem.T_base_tool, problem.corners)
        noise = measured_noise(linear, state, problem.free, problem.corners.corners)
    return refine(problem, state, noise), noise


def agreeing_views(
    problem: Problem, fitted: NDArray[np.intp], state: State
) -> tuple[NDArray[np.intp], dict[int, str], State, Noise]:
    """Those of the ``fitted`` views whose arm pose and image agree with the others.

    Also the views left out with the reasons, and the fit, with the board's scale free: a board
    of the wrong size would make good poses look like bad ones. Raises CalibrationError when
    more than 30 % disagree.
    """
    rejected: dict[int, str] = {}
    used, noise = fitted, _FIRST_NOISE
    for _ in range(_REJECTIONS):
        part = with_scale(problem.only(used))
        state, noise = fit_with_noise(part, state, noise)
        wrong = misfits(linearise(state, part.T_base_tool, part.corners), noise)
        if not wrong:
            break
        rejected |= {int(used[i]): why for i, why in wrong.items()}
        used = np.array([n for n in used if n not in rejected], dtype=np.intp)
        if len(rejected) > _MAX_LOST * len(fitted):
            first = min(rejected)
            raise CalibrationError(
                f"{len(rejected)} of {len(fitted)} poses contradict the others (number {first}: "
                f"{rejected[first]}): is each image stored with the pose the arm had, did the "
                "board stay where it was, is the camera fixed?"
            )
    return used, rejected, state, noise


def with_scale(problem: Problem) -> Problem:
    """The problem with the board's scale among its unknowns."""
    free = problem.free.copy()
    free[SCALE] = True
    return Problem(problem.T_base_tool, problem.corners, free, problem.prior)


def std_of_scale(problem: Problem, state: State, noise: Noise) -> float:
    """Standard deviation of the board's scale."""
    covariance = pulls(with_scale(problem), state, noise).covariance
    return float(np.sqrt(covariance[-1, -1]))  # the scale is the last unknown
