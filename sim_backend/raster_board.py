"""The calibration board in the software renderer: laid over the picture of what is behind it."""

import math

import numpy as np
from numpy.typing import NDArray

from sim_backend.board import Board
from sim_backend.lens import Lens
from sim_backend.raster_sheet import Axis, Print, paint_rows

FloatArray = NDArray[np.float64]

_MOST_BINS = 8192
# Sub-exposures this far apart blur edges like continuous motion, as a pixel's width is more.
_STEP_PX = 0.75
_EDGE_ON_M = 1e-6  # a camera this close to the board's plane does not see it


class BoardPainter:
    """Paints one board, lit as the rest of the scene, with exact area coverage."""

    def __init__(self, board: Board, lens: Lens, light: FloatArray, ambient: float) -> None:
        self._T_board_base = np.linalg.inv(board.T_base_board)
        self._focal_px = lens.focal_px
        self._corners = lens.corner_ray_table()
        self._x_axis, self._y_axis = _axis(board.columns_m), _axis(board.rows_m)
        white = np.full(board.greys.shape, board.white_grey)
        sheet = _printed(np.ones(board.greys.shape), board.columns_m)
        self._front = (_printed(board.greys, board.columns_m), sheet)
        self._back = (_printed(white, board.columns_m), sheet)
        ends = [(x, y, 1.0) for x in board.columns_m[[0, -1]] for y in board.rows_m[[0, -1]]]
        self._ends = np.array(ends).T  # (3, 4) homogeneous corners of the sheet
        self._normal = board.T_base_board[:3, 2]
        self._light, self._ambient = light, ambient

    def paint(self, image: NDArray[np.float32], row0: int, T_base_camera: FloatArray) -> None:
        """Lay the board over ``image``, the rows from ``row0``, averaged over the poses."""
        T = self._T_board_base @ T_base_camera
        heights = -T[:, 2, 3]  # above the printed side
        side = 1.0 if heights[0] > 0.0 else -1.0
        if np.any(side * heights < _EDGE_ON_M):
            return
        views = side * _views(T)
        count = math.ceil(self._motion_px(views) / _STEP_PX)
        lit = max(-side * float(self._normal @ self._light), 0.0)
        paint_rows(
            image,
            row0,
            self._corners,
            _thinned(views, min(max(count, 1), len(views))),
            self._x_axis,
            self._y_axis,
            self._front if side > 0.0 else self._back,
            self._ambient + (1.0 - self._ambient) * lit,
        )

    def _motion_px(self, views: FloatArray) -> float:
        """How far, at most, a corner of the sheet in view moves from the first pose to the last."""
        first, last = (np.linalg.solve(view, self._ends) for view in views[[0, -1]])
        ahead = (first[2] > 0.0) & (last[2] > 0.0)
        if not np.any(ahead):
            return 0.0
        moved = first[:2, ahead] / first[2, ahead] - last[:2, ahead] / last[2, ahead]
        return self._focal_px * float(np.hypot(moved[0], moved[1]).max())

    def hides(self, points: FloatArray, T_base_camera: FloatArray) -> NDArray[np.bool_]:
        """Which of the points (n, 3) in base lie on the other side of the board's plane."""
        R, p = self._T_board_base[2, :3], self._T_board_base[2, 3]
        camera = R @ T_base_camera[:3, 3] + p
        hidden: NDArray[np.bool_] = (points @ R + p) * camera < 0.0
        return hidden


def _views(T_board_camera: FloatArray) -> FloatArray:
    """Matrices (k, 3, 3) from rays (x, y, 1) to homogeneous points of the board's plane."""
    R, o = T_board_camera[:, :3, :3], T_board_camera[:, :3, 3]
    views = o[:, :, None] * R[:, None, 2, :] - o[:, 2, None, None] * R
    views[:, 2, :] = R[:, 2, :]
    return np.ascontiguousarray(views)


def _thinned(views: FloatArray, count: int) -> FloatArray:
    """``count`` views, evenly spread over the same time, between the given ones."""
    at = (np.arange(count) + 0.5) * len(views) / count - 0.5
    before = np.minimum(at.astype(int), max(len(views) - 2, 0))
    after = np.minimum(before + 1, len(views) - 1)
    share = (at - before)[:, None, None]
    return np.ascontiguousarray((1.0 - share) * views[before] + share * views[after])


def _axis(breaks_m: FloatArray) -> Axis:
    length_m = float(breaks_m[-1] - breaks_m[0])
    widths_m = np.diff(breaks_m)
    least_m = float(widths_m[widths_m > 0.0].min())
    bins = int(np.clip(np.ceil(length_m / least_m), 1, _MOST_BINS))
    begin_m = breaks_m[0] + length_m / bins * np.arange(bins + 1)
    # One too low where the bin begins in a later cell than rounding may say.
    table = np.concatenate([[0], np.searchsorted(breaks_m, begin_m, side="right") - 1])
    return Axis(np.append(breaks_m, np.inf), table.astype(np.int32), bins / length_m)


def _printed(greys: FloatArray, columns_m: FloatArray) -> Print:
    padded = np.pad(greys, 1)
    starts = np.concatenate([columns_m[:1], columns_m])
    widths = np.diff(starts, append=starts[-1])
    sums = np.cumsum(padded * widths, axis=1) - padded * widths
    return Print(padded, np.ascontiguousarray(sums), starts)
