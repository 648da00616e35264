"""A printed sheet seen through pixels: each pixel's exact mean over the area it covers.

The print is a grid of cells of constant grey. A pixel sees a quadrilateral of the sheet; by
Green's theorem the integral of the grey over it is that of Q dy around its rim, where Q is the
grey's integral along x. Along a straight line Q is linear between the cells' borders, so the
sums are exact and edges, corners and cells smaller than a pixel need no case of their own.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_backend.jit import jit
from sim_backend.raster_pixel import covered_share

FloatArray = NDArray[np.float64]
Image = NDArray[np.float32]
Indices = NDArray[np.int32]

TILE = 16


class Axis(NamedTuple):
    """Where the cells of one axis begin; cell 0 and the last one lie outside the sheet."""

    breaks: FloatArray  # (n + 2,) ascending: cell i ends at breaks[i], the last one nowhere
    table: Indices  # the cell in which each of equally wide bins begins, and one bin before them
    bins_per_m: float


class Print(NamedTuple):
    """Greys of the cells and their integrals along x."""

    greys: FloatArray  # (m + 2, n + 2), 0 outside
    sums: FloatArray  # (m + 2, n + 2) of greys from the sheet's left to where the cell begins
    starts: FloatArray  # (n + 2,) where that is


@jit
def paint_rows(
    image: Image, row0: int, corners: Image, views: FloatArray, x_axis: Axis, y_axis: Axis,
    prints: tuple[Print, Print], light: float,
) -> None:  # fmt: skip
    """Lay the sheet over ``image`` (h, w), the camera's rows from ``row0`` on.

    ``corners`` (2, height + 1, width + 1) are the rays through the pixels' corners; ``views``
    (k, 3, 3) map a ray to the sheet's plane, homogeneous and positive where it meets the plane;
    ``prints`` are what is printed and the sheet itself, all ones; ``light`` falls on it.
    """
    k = views.shape[0]
    height, width = image.shape
    x, y = np.empty((TILE + 1, TILE + 1)), np.empty((TILE + 1, TILE + 1))
    i, j = np.empty((TILE + 1, TILE + 1), np.int32), np.empty((TILE + 1, TILE + 1), np.int32)
    radiance, cover = np.empty((TILE, TILE)), np.empty((TILE, TILE))
    for v0 in range(0, height, TILE):
        v1 = min(v0 + TILE, height)
        for u0 in range(0, width, TILE):
            u1 = min(u0 + TILE, width)
            rays = corners[:, row0 + v0 : row0 + v1 + 1, u0 : u1 + 1]
            seen = False
            for n in range(k):
                if not _may_meet(rays, views[n], x_axis.breaks, y_axis.breaks):
                    continue
                if not seen:
                    seen = True
                    radiance[:] = 0.0
                    cover[:] = 0.0
                _locate(rays, views[n], x_axis, y_axis, x, y, i, j)
                _add_tile(x, y, i, j, x_axis, y_axis, prints, light, radiance, cover, rays)
            if seen:
                for v in range(v1 - v0):
                    for u in range(u1 - u0):
                        behind = image[v0 + v, u0 + u] * (1.0 - cover[v, u] / k)
                        image[v0 + v, u0 + u] = behind + radiance[v, u] / k


@jit
def _may_meet(rays: Image, view: FloatArray, columns: FloatArray, rows: FloatArray) -> bool:
    """Whether a tile of ``rays`` may meet the sheet: not all beyond one of its sides."""
    bottom, right = rays.shape[1] - 1, rays.shape[2] - 1
    beyond = np.zeros(4, np.int64)
    for v in (0, bottom):
        for u in (0, right):
            x, y = float(rays[0, v, u]), float(rays[1, v, u])
            p = view[0, 0] * x + view[0, 1] * y + view[0, 2]
            q = view[1, 0] * x + view[1, 1] * y + view[1, 2]
            w = view[2, 0] * x + view[2, 1] * y + view[2, 2]
            beyond[0] += p < columns[0] * w
            beyond[1] += p > columns[-2] * w
            beyond[2] += q < rows[0] * w
            beyond[3] += q > rows[-2] * w
    return bool(np.max(beyond) < 4)


@jit
def _locate(
    rays: Image, view: FloatArray, x_axis: Axis, y_axis: Axis, x: FloatArray, y: FloatArray,
    i: Indices, j: Indices,
) -> None:  # fmt: skip
    """Where the pixels' corners lie in the sheet's plane, and in which cells."""
    height, width = rays.shape[1], rays.shape[2]
    for v in range(height):
        for u in range(width):
            a, b = float(rays[0, v, u]), float(rays[1, v, u])
            w = view[2, 0] * a + view[2, 1] * b + view[2, 2]
            w = 1.0 / w if w > 1e-9 else 1e9
            x[v, u] = w * (view[0, 0] * a + view[0, 1] * b + view[0, 2])
            y[v, u] = w * (view[1, 0] * a + view[1, 1] * b + view[1, 2])
    _cells(x_axis, x, height, width, i)
    _cells(y_axis, y, height, width, j)


@jit
def _cells(axis: Axis, at: FloatArray, height: int, width: int, cells: Indices) -> None:
    """The cell in which each coordinate lies."""
    breaks, table, scale = axis
    first, bins = breaks[0], float(table.size - 1)
    for v in range(height):
        for u in range(width):
            bin_ = (at[v, u] - first) * scale + 1.0
            bin_ = bin_ if bin_ > 0.0 else 0.0
            cell = table[int(bin_ if bin_ < bins else bins)]
            while at[v, u] >= breaks[cell]:
                cell += 1
            cells[v, u] = cell


@jit
def _add_tile(
    x: FloatArray, y: FloatArray, i: Indices, j: Indices, x_axis: Axis, y_axis: Axis,
    prints: tuple[Print, Print], light: float, radiance: FloatArray, cover: FloatArray,
    rays: Image,
) -> None:  # fmt: skip
    """Add one pose's radiance and coverage of every pixel of a tile."""
    printed, sheet = prints
    columns, rows = x_axis.breaks, y_axis.breaks
    for v in range(rays.shape[1] - 1):
        for u in range(rays.shape[2] - 1):
            i0 = min(min(i[v, u], i[v, u + 1]), min(i[v + 1, u], i[v + 1, u + 1]))
            i1 = max(max(i[v, u], i[v, u + 1]), max(i[v + 1, u], i[v + 1, u + 1]))
            j0 = min(min(j[v, u], j[v, u + 1]), min(j[v + 1, u], j[v + 1, u + 1]))
            j1 = max(max(j[v, u], j[v, u + 1]), max(j[v + 1, u], j[v + 1, u + 1]))
            covered = sheet.greys[j0, i0]
            if i0 == i1 and j0 == j1:
                grey = printed.greys[j0, i0]
            elif i0 > 0 and j0 > 0 and i1 < columns.size - 1 and j1 < rows.size - 1:
                a, b = printed.greys[j0, i0], printed.greys[j0, i1]
                c, d = printed.greys[j1, i0], printed.greys[j1, i1]
                few = i1 - i0 <= 1 and j1 - j0 <= 1
                if few and a == c and b == d:
                    grey = a if a == b else a + (b - a) * _share(x, v, u, columns[i0])
                elif few and a == b and c == d:
                    grey = a + (c - a) * _share(y, v, u, rows[j0])
                else:
                    grey = _mean_grey(x, y, i, j, v, u, columns, rows, printed)
            else:
                grey = _mean_grey(x, y, i, j, v, u, columns, rows, printed)
                covered = _mean_grey(x, y, i, j, v, u, columns, rows, sheet)
            radiance[v, u] += light * grey
            cover[v, u] += covered


@jit
def _share(x: FloatArray, v: int, u: int, border: float) -> float:
    """The share of pixel (v, u), taken as a parallelogram, in which ``x`` exceeds ``border``."""
    first, last = x[v, u], x[v + 1, u + 1]
    right, below = x[v, u + 1], x[v + 1, u]
    du, dv = (right - first + last - below) / 2.0, (below - first + last - right) / 2.0
    norm = np.sqrt(du * du + dv * dv)
    distance = (first + last + right + below) / 4.0 - border
    return float(covered_share(distance / norm, du / norm, dv / norm))


@jit
def _mean_grey(
    x: FloatArray, y: FloatArray, i: Indices, j: Indices, v: int, u: int, columns: FloatArray,
    rows: FloatArray, printed: Print,
) -> float:  # fmt: skip
    """The mean grey of pixel (v, u)."""
    total, v0, u0 = 0.0, v, u
    for side in range(4):
        v1, u1 = v + (side == 1 or side == 2), u + (side == 0 or side == 1)
        total += _along(
            x[v0, u0], y[v0, u0], x[v1, u1], y[v1, u1], i[v0, u0], j[v0, u0], columns, rows,
            printed,
        )  # fmt: skip
        v0, u0 = v1, u1
    area = (x[v + 1, u + 1] - x[v, u]) * (y[v + 1, u] - y[v, u + 1])
    area -= (x[v + 1, u] - x[v, u + 1]) * (y[v + 1, u + 1] - y[v, u])
    return float(2.0 * total / area)


@jit
def _along(
    x0: float, y0: float, x1: float, y1: float, i: int, j: int, columns: FloatArray,
    rows: FloatArray, printed: Print,
) -> float:  # fmt: skip
    """The integral of Q dy along a straight line that begins in the cell (j, i)."""
    greys, sums, starts = printed
    dx, dy = x1 - x0, y1 - y0
    x, y, total = x0, y0, 0.0
    while True:
        to_column, to_row = 2.0, 2.0  # where the line leaves the cell, as shares of its length
        if dx > 0.0:
            to_column = (columns[i] - x0) / dx
        elif dx < 0.0 and i > 0:
            to_column = (columns[i - 1] - x0) / dx
        if dy > 0.0:
            to_row = (rows[j] - y0) / dy
        elif dy < 0.0 and j > 0:
            to_row = (rows[j - 1] - y0) / dy
        to = min(to_column, to_row)
        ends = to >= 1.0
        x_next, y_next = (x1, y1) if ends else (x0 + to * dx, y0 + to * dy)
        middle = 0.5 * (x + x_next) - starts[i]
        total += (sums[j, i] + greys[j, i] * middle) * (y_next - y)
        if ends:
            return float(total)
        if to_column <= to_row:
            i += 1 if dx > 0.0 else -1
        else:
            j += 1 if dy > 0.0 else -1
        x, y = x_next, y_next
