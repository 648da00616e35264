"""Weighted least squares over all images of a run, the arm's motion taken as it is measured."""

import numpy as np
from numpy.typing import NDArray

from estimator.camera_path import CameraPath, across, carried, oriented, path_from
from estimator.estimate import Correction, Estimate
from estimator.image.feature import Feature
from estimator.kalman import RadiusPrior
from estimator.models.model import Model
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]

# Of s, as a share: no image is more exact.
_FINEST = 1e-7
# Stands for certainty that a cylinder's s has nothing along its axis.
_CERTAIN = 1e12


class BatchLeastSquares:
    """s at the first image and χ that fit all images best, each weighted by its covariance.

    Every image says s_k = R_k s_0 − (I − a aᵀ) d_k χ. The normal equations are summed, so an
    image costs the same however many there were. Unlike the Kalman filter it takes the measured
    motion for true: the longer the run, the more of the arm's noise is left in χ̂, and beyond
    what the residuals show the stated variance does not know of it.
    """

    def __init__(self, model: Model, prior: RadiusPrior) -> None:
        self._model = model
        self._prior = prior
        self._path: CameraPath | None = None
        self._normal = np.zeros((4, 4))
        self._right = np.zeros(4)
        self._squares = 0.0  # Σ sᵀ W s
        self._equations = 0
        self._estimate: Estimate | None = None

    def correct(self, feature: Feature, t_s: float, motion: TwistHistory) -> Correction:
        """Add an image; see ``Estimator``. Raises MotionUnknownError, nothing being changed.

        When the motion since the last image is lost, all images before are forgotten.
        """
        last = self._estimate
        s, axis = oriented(self._model, feature, None if last is None else last.axis)
        if last is None or self._path is None:
            self._begin(t_s, axis, self._prior.chi, self._prior.variance)
            self._add(s, axis, feature.covariance, 0.0)
            return Correction.INITIALISED
        if t_s <= last.t_s:
            return Correction.STALE
        if len(motion) and not motion.covers(last.t_s) and motion.covers(t_s):
            self._begin(t_s, axis, last.chi, last.variance or self._prior.variance)
            self._add(s, axis, feature.covariance, last.residual)
            return Correction.RESTARTED
        residual = float(np.linalg.norm(s - carried(last, t_s, motion).s))
        self._path = self._path.until(t_s, motion)
        self._add(s, axis, feature.covariance, residual)
        return Correction.APPLIED

    @property
    def estimate(self) -> Estimate | None:
        """The fit at the last image's exposure; None before the first image."""
        return self._estimate

    def predict(self, now_s: float, motion: TwistHistory) -> Estimate:
        """The target at ``now_s``; see ``Estimator``."""
        if self._estimate is None:
            raise ValueError(f"there is no image at or before {now_s:.6f} s to predict from")
        return carried(self._estimate, now_s, motion)

    def _begin(self, t_s: float, axis: FloatArray | None, chi: float, variance: float) -> None:
        self._path = path_from(t_s)
        self._normal, self._right = np.zeros((4, 4)), np.zeros(4)
        self._normal[3, 3], self._right[3] = 1.0 / variance, chi / variance
        if axis is not None:
            self._normal[:3, :3] = _CERTAIN * np.outer(axis, axis)
        self._squares, self._equations = chi**2 / variance, -3 if axis is None else -2

    def _add(
        self, s: FloatArray, axis: FloatArray | None, covariance: FloatArray, residual: float
    ) -> None:
        """Sum one image up and solve."""
        assert self._path is not None
        plane = across(axis)
        H = np.empty((3, 4))
        H[:, :3], H[:, 3] = plane @ self._path.R, -plane @ self._path.d
        floor = (_FINEST * float(np.linalg.norm(s))) ** 2 * np.eye(3)
        W = plane @ np.linalg.inv(_regular(covariance, axis) + floor) @ plane
        self._normal += H.T @ W @ H
        self._right += H.T @ (W @ s)
        self._squares += float(s @ W @ s)
        self._equations += 3 if axis is None else 2
        x = np.linalg.solve(self._normal, self._right)
        left = max(self._squares - float(x @ self._right), 0.0)
        factor = max(1.0, left / self._equations) if self._equations > 3 else 1.0
        self._estimate = Estimate(
            t_s=self._path.t_s,
            s=H[:, :3] @ x[:3] + H[:, 3] * x[3],
            axis=axis,
            chi=float(x[3]),
            variance=factor * float(np.linalg.inv(self._normal)[3, 3]),
            residual=residual,
        )


def _regular(covariance: FloatArray, axis: FloatArray | None) -> FloatArray:
    """The covariance with what is along the axis made independent of the rest, to invert it."""
    if axis is None:
        return covariance
    plane = across(axis)
    inside: FloatArray = plane @ covariance @ plane
    regular: FloatArray = inside + np.trace(inside) * np.outer(axis, axis)
    return regular
