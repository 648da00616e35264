"""What the next pose should add: which tilt, roll, distance or part of the image is missing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from rig.calibration.board_pose import board_poses
from rig.calibration.intrinsics_checks import Coverage, coverage_of
from rig.calibration.views import PosedView

FloatArray = NDArray[np.float64]

_TILT_RAD, _ROLL_RAD = np.radians(15.0), np.radians(15.0)
_DISTANCES = 1.35  # farthest over nearest
_COVERED = 0.8
# Which side of the board is nearer, for a board that is tilted that way.
_SIDES = ("right", "left", "bottom", "top")


@dataclass(frozen=True, slots=True)
class Guidance:
    """What there is, and what to do next."""

    coverage: Coverage | None  # None before the first view
    done: tuple[str, ...]
    missing: tuple[str, ...]  # what to do, the most urgent first


def guide(
    views: Sequence[PosedView], intrinsics: Intrinsics, size: tuple[int, int], wanted: int
) -> Guidance:
    """What ``views`` lack for intrinsics and hand-eye; rough ``intrinsics`` will do."""
    if not views:
        return Guidance(None, (), ("show the whole board in the middle of the image",))
    T = board_poses([view.board for view in views], intrinsics)
    coverage = coverage_of([view.board for view in views], T, size)
    checks = [*_tilts(T), *_rolls(T), _distances(coverage), _covered(coverage)]
    enough = len(views) >= wanted
    checks.append((f"{len(views)} poses", "" if enough else f"{wanted - len(views)} more poses"))
    return Guidance(
        coverage,
        tuple(name for name, todo in checks if not todo),
        tuple(todo for _, todo in checks if todo),
    )


def tilt_and_roll(T_camera_board: FloatArray) -> tuple[float, float, float]:
    """Tilt about the image's vertical and horizontal axis, and roll, rad.

    A positive first one brings the board's right side nearer, a positive second one its bottom.
    """
    normal = T_camera_board[:3, 2] * (np.sign(T_camera_board[2, 2]) or 1.0)
    roll = np.arctan2(T_camera_board[1, 0], T_camera_board[0, 0])
    return (
        float(np.arctan2(normal[0], normal[2])),
        float(np.arctan2(normal[1], normal[2])),
        float(roll),
    )


def _tilts(T: FloatArray) -> list[tuple[str, str]]:
    tilts = np.array([tilt_and_roll(one)[:2] for one in T])
    ways = (tilts[:, 0], -tilts[:, 0], tilts[:, 1], -tilts[:, 1])
    out = []
    for side, way in zip(_SIDES, ways, strict=True):
        missing = float(way.max()) < _TILT_RAD
        todo = f"tilt the camera until the {side} of the image is clearly nearer to the board"
        out.append((f"{side} tilted nearer", todo if missing else ""))
    return out


def _rolls(T: FloatArray) -> list[tuple[str, str]]:
    rolls = np.array([tilt_and_roll(one)[2] for one in T])
    from_first = np.angle(np.exp(1j * (rolls - rolls[0])))
    # A camera that rolls one way turns the board in its image the other way.
    out = []
    for name, way in (("clockwise", -from_first), ("counter-clockwise", from_first)):
        missing = float(way.max()) < _ROLL_RAD
        todo = f"roll the camera {name} about its viewing direction by 20° or more"
        out.append((f"rolled {name}", todo if missing else ""))
    return out


def _distances(coverage: Coverage) -> tuple[str, str]:
    near, far = float(coverage.distance_m.min()), float(coverage.distance_m.max())
    if far / near >= _DISTANCES:
        return "near and far", ""
    return (
        "near and far",
        f"look from nearer or farther than {100 * near:.0f} to {100 * far:.0f} cm",
    )


def _covered(coverage: Coverage) -> tuple[str, str]:
    if coverage.share >= _COVERED:
        return "image covered", ""
    where = coverage.empty
    where = "where dots are missing" if where == "corners" else f"at the {where} of the image"
    return "image covered", f"show the board {where}"
