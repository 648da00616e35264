"""The camera's intrinsics from views of the board."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from rig.calibration import se3
from rig.calibration.board_pose import MIN_CORNERS
from rig.calibration.errors import CalibrationError
from rig.calibration.intrinsics_checks import Coverage, check_result, check_views, coverage_of
from rig.calibration.intrinsics_deviations import covariance_of
from rig.calibration.intrinsics_model import HeldOut, choose_model
from rig.calibration.lens_model import FULL, LensModel
from rig.calibration.projection import from_vector
from rig.calibration.views import BoardView

FloatArray = NDArray[np.float64]

_ROUNDS = 4  # of rejecting and fitting again
_CORNER_SIGMAS = 5.0
_VIEW_RATIO = 3.0  # a view this many times worse than the median view is an outlier
_FLOOR_PX = 0.05  # residuals below this are never outliers
_MAX_LOST = 0.3  # of the views: more than this are no outliers but a wrong board


@dataclass(frozen=True, slots=True)
class IntrinsicsFit:
    """The intrinsics and how far to trust them; ``std`` and ``covariance`` as in NAMES."""

    intrinsics: Intrinsics
    std: FloatArray  # (9,) 0 where a coefficient was not fitted
    covariance: FloatArray  # (9, 9)
    model: LensModel
    held_out: tuple[HeldOut, ...]  # the error of every model tried on images it had not seen
    rms_px: float  # rms distance of the corners used
    T_camera_board: FloatArray  # (m, 4, 4) of the views used
    used: NDArray[np.intp]  # (m,) numbers of the views used
    rejected_views: dict[int, str]  # number of the view and why
    rejected_corners: int
    residuals_px: tuple[FloatArray, ...]  # (n, 2) of each view used: seen minus predicted
    views: tuple[BoardView, ...]  # the views used, without the rejected corners
    coverage: Coverage

    @property
    def held_out_px(self) -> float:
        """The chosen model's rms distance of the corners on images it had not seen."""
        return next(one.rms_px for one in self.held_out if one.model is self.model)


@dataclass(frozen=True, slots=True)
class RawFit:
    """What one call of OpenCV's calibration gives."""

    values: FloatArray  # (9,)
    T_camera_board: FloatArray  # (m, 4, 4)
    residuals_px: tuple[FloatArray, ...]


def fit_intrinsics(
    views: Sequence[BoardView], size: tuple[int, int], min_views: int = 8
) -> IntrinsicsFit:
    """Intrinsics of a camera with images of ``size`` (width, height) px from views of one board.

    Views and corners that contradict the rest are left out and reported. Among the numbers of
    distortion coefficients it takes the largest that images left out of the fit do not speak
    against: a coefficient too many costs a little certainty, one too few biases the principal
    point. Raises CalibrationError when the views do not determine the result; it says which
    views are missing.
    """
    check_views(views, min_views)
    kept, rejected, lost_corners = _without_outliers(list(views), size)
    used = np.array(sorted(kept), dtype=np.intp)
    chosen = [kept[i] for i in used]
    check_views(chosen, min_views, of=len(views))
    model, held_out = choose_model(chosen, size, calibrate)
    raw = calibrate(chosen, size, model)
    covariance, rms_px = covariance_of(chosen, raw.values, raw.T_camera_board, model)
    # What fitting the coefficients left out would change is part of the uncertainty: one too
    # small to be noticed still moves the principal point.
    shift = (calibrate(chosen, size, FULL).values - raw.values) * model.free
    covariance += np.outer(shift, shift)
    fit = IntrinsicsFit(
        intrinsics=from_vector(raw.values),
        std=np.sqrt(np.diag(covariance)),
        covariance=covariance,
        model=model,
        held_out=held_out,
        rms_px=rms_px,
        T_camera_board=raw.T_camera_board,
        used=used,
        rejected_views=rejected,
        rejected_corners=lost_corners,
        residuals_px=raw.residuals_px,
        views=tuple(chosen),
        coverage=coverage_of(chosen, raw.T_camera_board, size),
    )
    check_result(raw.values, fit.std, fit.coverage)
    return fit


def calibrate(views: Sequence[BoardView], size: tuple[int, int], model: LensModel) -> RawFit:
    """One fit of ``model`` to the views; raises CalibrationError when OpenCV finds none."""
    points = [view.points_m.astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32) for view in views]
    try:
        # The matrices are only outputs here, but the binding wants them.
        _, K, d, turns, shifts, *_ = cv2.calibrateCameraExtended(
            points, pixels, size, np.eye(3), np.zeros(5), flags=model.flags
        )
    except cv2.error as error:
        raise CalibrationError(
            "no intrinsics fit these views: tilt the board against the camera by 20° to 40°, "
            f"differently from image to image ({error.err})"
        ) from error
    values = np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], *d.ravel()[:5]])
    if not np.all(np.isfinite(values)):
        raise CalibrationError("the intrinsics did not converge: take views with more tilt")
    poses = [
        se3.from_xyz_rotvec(np.asarray(t, float).ravel(), np.asarray(r, float).ravel())
        for r, t in zip(turns, shifts, strict=True)
    ]
    residuals = [
        view.pixels - cv2.projectPoints(view.points_m, r, t, K, d)[0][:, 0]
        for view, r, t in zip(views, turns, shifts, strict=True)
    ]
    return RawFit(values, np.array(poses), tuple(residuals))


def _without_outliers(
    views: list[BoardView], size: tuple[int, int]
) -> tuple[dict[int, BoardView], dict[int, str], int]:
    """The views and corners that agree with each other; the views left out, and why."""
    kept, rejected = dict(enumerate(views)), dict[int, str]()
    for _ in range(_ROUNDS):
        numbers = list(kept)
        residuals = calibrate([kept[i] for i in numbers], size, FULL).residuals_px
        rms = np.array([np.sqrt(np.mean(r**2)) for r in residuals])
        bound_px = max(_VIEW_RATIO * float(np.median(rms)), 2 * _FLOOR_PX)
        sigma_px = 1.4826 * float(np.median(np.abs(np.concatenate(residuals))))
        worst = max(_CORNER_SIGMAS * sigma_px, _FLOOR_PX)
        changed = False
        for number, residual, own_px in zip(numbers, residuals, rms, strict=True):
            good = np.max(np.abs(residual), axis=1) <= worst
            if good.all() and own_px <= bound_px:
                continue
            changed = True
            # A few bad corners are dropped; a view that is bad all over goes as a whole.
            if good.sum() >= max(MIN_CORNERS, 0.7 * len(good)):
                kept[number] = kept[number].only(good)
            else:
                del kept[number]
                rejected[number] = (
                    f"its corners fit {own_px:.2f} px rms, the median view {np.median(rms):.2f} px"
                )
        if len(rejected) > _MAX_LOST * len(views):
            raise CalibrationError(
                f"{len(rejected)} of {len(views)} views contradict the others: is the board flat, "
                "is it the one that was defined, and did focus and zoom stay fixed?"
            )
        if not changed:
            break
    lost = sum(len(views[i]) - len(view) for i, view in kept.items())
    return kept, rejected, lost
