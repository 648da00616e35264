"""From what was collected to numbers: intrinsics and hand-eye together, latency, verification."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibration.board import BoardConfig
from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye import HandEyeFit, HandEyeSettings, solve_hand_eye
from rig.calibration.hand_eye_held_out import HeldOutError, held_out_error
from rig.calibration.hand_eye_model import State
from rig.calibration.intrinsics import IntrinsicsFit, fit_intrinsics
from rig.calibration.latency import LatencyFit, fit_latency
from rig.calibration.lens_model import FULL, MODELS
from rig.calibration.projection import to_vector
from rig.calibration.result import IntrinsicsResult
from rig.calibration.result_make import intrinsics_of
from rig.calibration.wiggle import Wiggle, WiggleVerdict, judge_wiggles
from rig.calibration_run.recording import Recording
from rig.calibration_run.stills import Still

FloatArray = NDArray[np.float64]

# Two sets of pictures of one camera agree about its focal length at least this well.
_SAME_FOCAL, _SURE_SIGMAS = 0.01, 6.0


@dataclass(frozen=True, slots=True)
class Geometry:
    """The camera and where it sits on the tool."""

    lens: IntrinsicsFit
    hand_eye: HandEyeFit

    @property
    def state(self) -> State:
        """The fitted values, as the other steps take them."""
        fit = self.hand_eye
        return State(fit.T_tool_camera, fit.T_base_board, to_vector(fit.intrinsics))


@dataclass(frozen=True, slots=True)
class Verification:
    """What fresh poses and small motions say about a calibration."""

    error: HeldOutError
    wiggles: WiggleVerdict


def fit_lens(stills: Sequence[Still]) -> IntrinsicsFit:
    """Intrinsics from images alone; raises CalibrationError with the views that are missing."""
    if not stills:
        raise CalibrationError("no image shows the board: there is nothing to fit")
    height, width = stills[0].image.shape[:2]
    return fit_intrinsics([still.view.board for still in stills], (width, height))


def fit_geometry(
    stills: Sequence[Still],
    board: BoardConfig,
    settings: HandEyeSettings,
    given: IntrinsicsResult | None = None,
) -> Geometry:
    """Intrinsics and hand-eye from stills with arm poses; raises CalibrationError.

    ``given`` are intrinsics from other pictures, which count as known that well before.
    """
    lens, views = fit_lens(stills), [still.view for still in stills]
    start, model, covariance = lens.intrinsics, lens.model, None
    if given is not None:
        _check_same_camera(given, lens)
        own = given.std
        std = np.array([own.fx_px, own.fy_px, own.cx_px, own.cy_px, *own.distortion])
        fitted = tuple(bool(one > 0.0) for one in std[4:])
        model = next((one for one in MODELS if one.coefficients == fitted), FULL)
        start, covariance = intrinsics_of(given), np.diag(std**2)
    hand_eye = solve_hand_eye(views, start, model, board.square_m, settings, covariance)
    return Geometry(lens, hand_eye)


def _check_same_camera(given: IntrinsicsResult, seen: IntrinsicsFit) -> None:
    """Raise CalibrationError where pictures tell of another lens than the rig's camera has."""
    for name, number in (("fx_px", 0), ("fy_px", 1)):
        before, now = getattr(given, name), getattr(seen.intrinsics, name)
        std = float(np.hypot(getattr(given.std, name), seen.std[number]))
        if abs(now - before) > max(_SAME_FOCAL * before, _SURE_SIGMAS * std):
            raise CalibrationError(
                f"the pictures say {name[:2]} = {before:.1f} px, the rig's camera has {now:.1f} ± "
                f"{seen.std[number]:.1f} px: they are of another camera, zoom, focus or mode. Take "
                "others for `rig calibrate intrinsics --from-images`, or find the intrinsics with "
                "the arm: `rig calibrate intrinsics`"
            )


def fit_delay(recording: Recording, geometry: Geometry, rolling: bool = False) -> LatencyFit:
    """How late the stamps are and, if ``rolling``, the time from row to row.

    Raises CalibrationError when segments disagree or are weak.
    """
    return fit_latency(
        recording.segments,
        recording.trajectory(),
        geometry.state,
        geometry.hand_eye.covariance,
        recording.height,
        rolling,
    )


def verify(stills: Sequence[Still], wiggles: Sequence[Wiggle], geometry: Geometry) -> Verification:
    """Judge a calibration by poses and motions that it was not fitted to."""
    state = geometry.state
    error = held_out_error([still.view for still in stills], state)
    fit = geometry.hand_eye
    return Verification(error, judge_wiggles(wiggles, fit.T_tool_camera, fit.intrinsics))
