"""Choosing the number of distortion coefficients by images that the fit has not seen."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.calibration.board_pose import board_pose
from rig.calibration.errors import CalibrationError
from rig.calibration.lens_model import MODELS, LensModel, folds
from rig.calibration.projection import from_vector
from rig.calibration.views import BoardView

FloatArray = NDArray[np.float64]

_FOLDS = 5
_DOUBT = 2.0  # standard errors


class Fitted(Protocol):
    """What is needed of a fit here."""

    @property
    def values(self) -> FloatArray:
        """The intrinsics (9,)."""
        ...


Fit = Callable[[Sequence[BoardView], tuple[int, int], LensModel], Fitted]


@dataclass(frozen=True, slots=True)
class HeldOut:
    """How well one model predicts images it has not seen."""

    model: LensModel
    rms_px: float  # rms distance of the corners; infinite where the model folds the image


def choose_model(
    views: Sequence[BoardView], size: tuple[int, int], fit: Fit
) -> tuple[LensModel, tuple[HeldOut, ...]]:
    """The largest model whose error on held-out images is not clearly above the best one's.

    Clearly: by more than two standard errors of the difference, image by image. A coefficient
    too few can go unnoticed here, because focal length, principal point and poses bend to hide
    it, and they are what is wanted. Raises CalibrationError when no model holds over the whole
    image.
    """
    errors = {model: _held_out(views, size, fit, model) for model in MODELS}
    corners = sum(len(view) for view in views)
    total = {model: float(np.sum(error)) for model, error in errors.items()}
    best = min(MODELS, key=lambda model: total[model])
    if not np.isfinite(total[best]):
        raise CalibrationError(
            "the distortion is not determined out to the image's corners: show the board there"
        )
    chosen = best
    for model in MODELS[MODELS.index(best) :]:
        if np.isfinite(total[model]):
            worse = errors[model] - errors[best]
            if float(worse.sum()) <= _DOUBT * float(worse.std()) * len(views) ** 0.5:
                chosen = model
    held_out = tuple(HeldOut(model, float(np.sqrt(total[model] / corners))) for model in MODELS)
    return chosen, held_out


def _held_out(
    views: Sequence[BoardView], size: tuple[int, int], fit: Fit, model: LensModel
) -> FloatArray:
    """Sum of squared residuals (m,) of each view under a fit without it, its pose free."""
    out = np.full(len(views), np.inf)
    count = min(_FOLDS, len(views))
    for fold in range(count):
        values = fit([v for i, v in enumerate(views) if i % count != fold], size, model).values
        if folds(values, size):
            return out
        for i in range(fold, len(views), count):
            out[i] = _residual(views[i], values)
    return out


def _residual(view: BoardView, values: FloatArray) -> float:
    intrinsics = from_vector(values)
    T = board_pose(view, intrinsics)
    off = view.pixels - intrinsics.project(view.points_m @ T[:3, :3].T + T[:3, 3])
    return float(np.sum(off**2))
