"""The textbook's way, for comparison: where lines of sight meet, and how large it is there."""

import numpy as np
from numpy.typing import NDArray

from estimator.camera_path import CameraPath, across, carried, oriented, path_from
from estimator.estimate import Correction, Estimate
from estimator.image.feature import Feature
from estimator.models.model import Model
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]

# The lines of sight count as parallel below this: the guess stands.
_LEAST_SPREAD_RAD2 = 1e-4


class Triangulation:
    """The point nearest to all lines of sight, and R from the apparent size: R = ‖P0‖ / ‖s‖.

    Lines count alike, whatever the images' noise; sizes are averaged. A cylinder's lines of
    sight are compared across its axis.
    """

    def __init__(self, model: Model, radius_guess_m: float) -> None:
        self._model = model
        self._guess_m = radius_guess_m
        self._path: CameraPath | None = None
        self._normal, self._right = np.zeros((3, 3)), np.zeros(3)
        self._sizes: list[tuple[CameraPath, FloatArray | None, float]] = []  # path, axis, ‖s‖
        self._estimate: Estimate | None = None

    def correct(self, feature: Feature, t_s: float, motion: TwistHistory) -> Correction:
        """Add an image; see ``Estimator``. Raises MotionUnknownError, nothing being changed.

        When the motion since the last image is lost, all images before are forgotten.
        """
        last = self._estimate
        s, axis = oriented(self._model, feature, None if last is None else last.axis)
        correction, residual = Correction.APPLIED, 0.0
        if last is None or self._path is None:
            correction, self._path = Correction.INITIALISED, path_from(t_s)
        elif t_s <= last.t_s:
            return Correction.STALE
        elif len(motion) and not motion.covers(last.t_s) and motion.covers(t_s):
            correction, self._path = Correction.RESTARTED, path_from(t_s)
            self._normal, self._right = np.zeros((3, 3)), np.zeros(3)
            self._sizes, self._guess_m = [], 1.0 / last.chi
        else:
            residual = float(np.linalg.norm(s - carried(last, t_s, motion).s))
            self._path = self._path.until(t_s, motion)
        self._add(self._path, s, axis, residual)
        return correction

    @property
    def estimate(self) -> Estimate | None:
        """The state at the last image's exposure; None before the first image."""
        return self._estimate

    def predict(self, now_s: float, motion: TwistHistory) -> Estimate:
        """The target at ``now_s``; see ``Estimator``."""
        if self._estimate is None:
            raise ValueError(f"there is no image at or before {now_s:.6f} s to predict from")
        return carried(self._estimate, now_s, motion)

    def _add(
        self, path: CameraPath, s: FloatArray, axis: FloatArray | None, residual: float
    ) -> None:
        norm = float(np.linalg.norm(s))
        n = s / norm
        # Across the line of sight, in the axes of the first image: X with R X − d along n.
        sideways = path.R.T @ (across(axis) - np.outer(n, n))
        self._normal += sideways @ path.R
        self._right += sideways @ path.d
        self._sizes.append((path, axis, norm))
        spread = np.linalg.eigvalsh(self._normal)[0 if axis is None else 1]
        radius_m = self._guess_m
        if spread > _LEAST_SPREAD_RAD2 * len(self._sizes):
            X = np.linalg.lstsq(self._normal, self._right, rcond=1e-6)[0]
            distances = (
                np.linalg.norm(across(a) @ (p.R @ X - p.d)) / size for p, a, size in self._sizes
            )
            radius_m = float(np.mean(list(distances)))
        self._estimate = Estimate(path.t_s, s.copy(), axis, 1.0 / radius_m, None, residual)
