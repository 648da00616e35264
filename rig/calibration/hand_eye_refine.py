"""Least squares on the reprojection error over hand-eye, board and intrinsics together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye_model import (
    INTRINSICS,
    UNKNOWNS,
    Noise,
    State,
    Whitener,
    linearise,
    whitener,
)
from rig.calibration.robust_fit import robust_fit, weights
from rig.calibration.views import Stack

FloatArray = NDArray[np.float64]

_ROUNDS = 3  # of setting the whitening anew: it depends on the state, but hardly


@dataclass(frozen=True, slots=True)
class Prior:
    """What is known of the intrinsics from other images."""

    values: FloatArray  # (9,)
    covariance: FloatArray  # (9, 9); zero for a coefficient that is held


@dataclass(frozen=True, slots=True)
class Problem:
    """What a refinement works on."""

    T_base_tool: FloatArray  # (m, 4, 4) as measured
    corners: Stack
    free: NDArray[np.bool_]  # (22,) which unknowns are fitted
    prior: Prior | None = None

    def only(self, which: NDArray[np.intp] | NDArray[np.bool_]) -> "Problem":
        """The problem reduced to some of its views."""
        return Problem(self.T_base_tool[which], self.corners.only(which), self.free, self.prior)


@dataclass(frozen=True, slots=True)
class Pull:
    """What each view says about the free unknowns, at the solution: a quadratic of its own."""

    normal: FloatArray  # (m, p, p)
    right: FloatArray  # (m, p); sums to nearly zero
    prior: FloatArray  # (p, p)

    @property
    def covariance(self) -> FloatArray:
        """Covariance (p, p) of the free unknowns."""
        return np.asarray(np.linalg.inv(self.normal.sum(axis=0) + self.prior), dtype=float)


def refine(problem: Problem, state: State, noise: Noise) -> State:
    """The state of least whitened, robust reprojection error near ``state``.

    Raises CalibrationError when the board ends up behind the camera or nothing converges.
    """
    free = problem.free
    root = _prior_root(problem)

    def moved(at: State, short: FloatArray) -> State:
        step = np.zeros(UNKNOWNS)
        step[free] = short
        return at.moved(step)

    for _ in range(_ROUNDS):
        white = whitener(linearise(state, problem.T_base_tool, problem.corners), noise)

        def evaluate(at: State, white: Whitener = white) -> tuple[FloatArray, FloatArray]:
            linear = linearise(at, problem.T_base_tool, problem.corners)
            J = white(linear.by_step[..., free]).reshape(-1, int(free.sum()))
            off = np.append(white(linear.residuals).ravel(), _prior_off(problem, at, root))
            return off, np.concatenate([J, root[:, free]])

        state = robust_fit(state, evaluate, moved)
    linear = linearise(state, problem.T_base_tool, problem.corners)
    if not linear.in_front or not np.all(np.isfinite(linear.residuals)):
        raise CalibrationError(
            "the hand-eye fit puts the board behind the camera: are images and arm poses paired "
            "rightly, and is T_base_tool the pose of the tool in the base, not its inverse?"
        )
    return state


def pulls(problem: Problem, state: State, noise: Noise) -> Pull:
    """What each view says at the solution, outliers weighted down as the fit weighted them."""
    free = problem.free
    linear = linearise(state, problem.T_base_tool, problem.corners)
    white = whitener(linear, noise)
    r, J = white(linear.residuals), white(linear.by_step[..., free])
    weighted = J * weights(r)[..., None]
    root = _prior_root(problem)[:, free]
    return Pull(
        normal=np.einsum("mni,mnj->mij", weighted, J),
        right=np.einsum("mni,mn->mi", weighted, r),
        prior=root.T @ root,
    )


def bootstrap(pull: Pull, replicates: int, seed: int) -> FloatArray:
    """Standard deviations (p,) from drawing the views anew, by one Newton step each.

    The weights are exponential rather than whole numbers, so that no draw loses all views
    that turn about one axis and with them the solution.
    """
    m = len(pull.normal)
    drawn = np.random.default_rng(seed).exponential(size=(replicates, m))
    normal = np.einsum("rm,mij->rij", drawn, pull.normal) + pull.prior
    right = np.einsum("rm,mi->ri", drawn, pull.right)
    steps = np.linalg.solve(normal, right[..., None])[..., 0]
    return np.asarray(np.std(steps, axis=0) * np.sqrt(m / max(m - 1, 1)), dtype=float)


def _prior_root(problem: Problem) -> FloatArray:
    """Rows (k, 22) that turn a step into independent deviations from the prior."""
    if problem.prior is None:
        return np.zeros((0, UNKNOWNS))
    known = np.diag(problem.prior.covariance) > 0.0
    block = problem.prior.covariance[np.ix_(known, known)]
    root = np.zeros((int(known.sum()), UNKNOWNS))
    columns = np.flatnonzero(known) + INTRINSICS.start
    root[:, columns] = np.linalg.inv(np.linalg.cholesky(block))
    return root


def _prior_off(problem: Problem, state: State, root: FloatArray) -> FloatArray:
    """The deviations (k,) of the prior's values from the state's."""
    if problem.prior is None:
        return np.zeros(0)
    off = np.zeros(UNKNOWNS)
    off[INTRINSICS] = problem.prior.values - state.intrinsics
    return root @ off
