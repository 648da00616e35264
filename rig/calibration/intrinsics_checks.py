"""Whether a set of views can determine the intrinsics, and which views are missing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibration.board_pose import MIN_CORNERS
from rig.calibration.errors import CalibrationError
from rig.calibration.views import BoardView

FloatArray = NDArray[np.float64]

_CELLS = (6, 5)  # columns and rows that the image is divided into
_MIN_CELLS = 0.6  # of them must hold a corner
_MIN_TILT_RAD = np.radians(12.0)
_MIN_TILTED = 4  # views tilted by at least that
_MAX_FOCAL_STD = 0.005  # of the focal length
_MAX_CENTRE_STD_PX = 5.0


@dataclass(frozen=True, slots=True)
class Coverage:
    """Where in the image the corners were, and from which directions the board was seen."""

    cells: NDArray[np.int64]  # (rows, columns) corners in each part of the image
    tilt_rad: FloatArray  # (m,) of the board's normal against the optical axis
    distance_m: FloatArray  # (m,)

    @property
    def share(self) -> float:
        """The share of the image's parts that hold a corner."""
        return float(np.mean(self.cells > 0))

    @property
    def empty(self) -> str:
        """Where corners are missing, in words."""
        rows, columns = self.cells.shape
        names = []
        for name, part in (
            ("top", self.cells[: rows // 3]),
            ("bottom", self.cells[rows - rows // 3 :]),
            ("left", self.cells[:, : columns // 3]),
            ("right", self.cells[:, columns - columns // 3 :]),
        ):
            if np.mean(part > 0) < _MIN_CELLS:
                names.append(name)
        return ", ".join(names) or "corners"


def check_views(views: Sequence[BoardView], min_views: int, of: int | None = None) -> None:
    """Raise CalibrationError unless there are enough views with enough corners."""
    few = [i for i, view in enumerate(views) if len(view) < MIN_CORNERS]
    if few:
        raise CalibrationError(
            f"view {few[0]} shows {len(views[few[0]])} corners, at least {MIN_CORNERS} are needed: "
            "leave it out or show more of the board"
        )
    if len(views) < min_views:
        of_all = "" if of is None or of == len(views) else f" (of {of}; the others were rejected)"
        raise CalibrationError(
            f"{len(views)} usable views of the board{of_all}, at least {min_views} are needed: "
            f"add {min_views - len(views)} or more, from different directions"
        )


def coverage_of(
    views: Sequence[BoardView], T_camera_board: FloatArray, size: tuple[int, int]
) -> Coverage:
    """Where the views' corners lie in images of ``size`` (width, height)."""
    pixels = np.concatenate([view.pixels for view in views])
    columns, rows = _CELLS
    edges = (np.linspace(0, size[1], rows + 1) - 0.5, np.linspace(0, size[0], columns + 1) - 0.5)
    counts, _, _ = np.histogram2d(pixels[:, 1], pixels[:, 0], bins=edges)
    middle = np.array([view.points_m.mean(axis=0) for view in views])
    seen = (T_camera_board[:, :3, :3] @ middle[..., None])[..., 0] + T_camera_board[:, :3, 3]
    tilt = np.arccos(np.clip(np.abs(T_camera_board[:, 2, 2]), 0.0, 1.0))
    return Coverage(counts.astype(np.int64), tilt, np.linalg.norm(seen, axis=1))


def check_result(values: FloatArray, std: FloatArray, coverage: Coverage) -> None:
    """Raise CalibrationError when the views were too frontal or left much of the image empty."""
    tilted = int(np.sum(coverage.tilt_rad >= _MIN_TILT_RAD))
    if tilted < _MIN_TILTED:
        raise CalibrationError(
            f"only {tilted} of {len(coverage.tilt_rad)} views are tilted by more than "
            f"{np.degrees(_MIN_TILT_RAD):.0f}°: seen frontally, a longer lens and a farther board "
            "look the same. Add views tilted by 20° to 40° about both image axes"
        )
    if coverage.share < _MIN_CELLS:
        raise CalibrationError(
            f"the corners cover {coverage.share:.0%} of the image, {_MIN_CELLS:.0%} are needed: "
            f"show the board further out ({coverage.empty})"
        )
    worst = float(np.max(std[:2] / values[:2]))
    if worst > _MAX_FOCAL_STD:
        raise CalibrationError(
            f"the focal length is only known to ± {worst:.1%}: add views that are tilted more, "
            "and closer ones"
        )
    if float(np.max(std[2:4])) > _MAX_CENTRE_STD_PX:
        raise CalibrationError(
            f"the principal point is only known to ± {np.max(std[2:4]):.1f} px: add views tilted "
            "about both image axes, and some turned about the optical axis"
        )
