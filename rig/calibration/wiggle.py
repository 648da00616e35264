"""Whether small motions of the arm move the image as the calibration predicts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from rig.calibration import se3
from rig.calibration.board_pose import board_pose
from rig.calibration.errors import CalibrationError
from rig.calibration.views import BoardView, PosedView
from rig.calibration.wiggle_diagnosis import diagnose
from rig.calibration.wiggle_motion import Glimpse

FloatArray = NDArray[np.float64]

AXES = ("x", "y", "z", "about x", "about y", "about z")
STEP_M = 0.005
STEP_RAD = np.radians(2.0)
_TOLERANCE = 0.05  # of the image motion
_FLOOR_PX = 0.5  # mismatch below this is never held against anything


@dataclass(frozen=True, slots=True)
class Wiggle:
    """One small motion: what was seen before and after, with the arm's poses."""

    axis: int  # of AXES, in the tool's frame
    before: PosedView
    after: PosedView


@dataclass(frozen=True, slots=True)
class WiggleResult:
    """Predicted against observed motion of the corners both images show."""

    axis: str
    predicted_px: FloatArray  # (n, 2) displacements
    observed_px: FloatArray  # (n, 2)
    at_px: FloatArray  # (n, 2) where the corners were before

    @property
    def motion_px(self) -> float:
        """Rms of the predicted displacements."""
        return float(np.sqrt(np.mean(np.sum(self.predicted_px**2, axis=1))))

    @property
    def mismatch_px(self) -> float:
        """Rms distance between predicted and observed displacements."""
        off = self.predicted_px - self.observed_px
        return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))

    @property
    def passed(self) -> bool:
        """Whether they agree within 5 %, or half a pixel."""
        return self.mismatch_px <= max(_TOLERANCE * self.motion_px, _FLOOR_PX)


@dataclass(frozen=True, slots=True)
class WiggleVerdict:
    """What the wiggles say together."""

    passed: bool
    findings: tuple[str, ...]  # what is wrong, most telling first; empty when passed
    results: tuple[WiggleResult, ...]


def wiggle_steps() -> FloatArray:
    """The six motions (6, 6) to make, as twists of the tool in its own axes."""
    return np.diag(np.repeat([STEP_M, STEP_RAD], 3))


def judge_wiggles(
    wiggles: Sequence[Wiggle], T_tool_camera: FloatArray, intrinsics: Intrinsics
) -> WiggleVerdict:
    """Compare every motion with its prediction; say which axis, sign or frame is wrong.

    Needs nothing of the board's place: the first image of each pair tells it. Raises
    CalibrationError when a pair shows too few corners or the arm did not move.
    """
    glimpses = [_glimpse(wiggle, T_tool_camera, intrinsics) for wiggle in wiggles]
    results = tuple(
        WiggleResult(AXES[w.axis], one.displacements(one.tool_moved), one.observed_px, _at(w))
        for w, one in zip(wiggles, glimpses, strict=True)
    )
    failed = [one for one in results if not one.passed]
    findings: list[str] = []
    if failed:
        kinds = [
            [g for g, w in zip(glimpses, wiggles, strict=True) if (w.axis < 3) is linear]
            for linear in (True, False)
        ]
        findings = diagnose(*kinds) + [
            f"moving {one.axis}: the image should have moved by {one.motion_px:.1f} px, "
            f"{one.mismatch_px:.1f} px of it disagree"
            for one in failed
        ]
    return WiggleVerdict(not failed, tuple(findings), results)


def _glimpse(wiggle: Wiggle, T_tool_camera: FloatArray, intrinsics: Intrinsics) -> Glimpse:
    before, after = _common(wiggle)
    moved = se3.log(se3.inverse(wiggle.before.T_base_tool) @ wiggle.after.T_base_tool)
    shift_m, turn_rad = np.linalg.norm(moved.reshape(2, 3), axis=1)
    if shift_m < 0.3 * STEP_M and turn_rad < 0.3 * STEP_RAD:
        raise CalibrationError(
            f"moving {AXES[wiggle.axis]}: the arm reports a motion of only {1e3 * shift_m:.1f} mm "
            f"and {np.degrees(turn_rad):.1f}°. Did it move, and was the pose read after it had "
            "come to rest?"
        )
    return Glimpse(
        points_m=before.points_m,
        T_camera_board=board_pose(before, intrinsics),
        T_tool_camera=T_tool_camera,
        intrinsics=intrinsics,
        tool_moved=moved,
        observed_px=after.pixels - before.pixels,
    )


def _at(wiggle: Wiggle) -> FloatArray:
    return _common(wiggle)[0].pixels


def _common(wiggle: Wiggle) -> tuple[BoardView, BoardView]:
    a, b = wiggle.before.board, wiggle.after.board
    shared = np.intersect1d(a.ids, b.ids)
    return a.only(np.isin(a.ids, shared)), b.only(np.isin(b.ids, shared))
