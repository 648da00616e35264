"""The software renderer's loops: tiles, then pixels; see ``raster_pixel`` for outlines.

A pixel away from every outline takes one ray; one near an outline is integrated over its area
for every sub-exposure.
"""

import numpy as np
from numpy.typing import NDArray

from sim_backend.jit import jit
from sim_backend.raster_floor import View, fill_floor, floor_grey, floor_view
from sim_backend.raster_pixel import pixel_at_outline
from sim_backend.raster_solids import (
    ROW,
    SPHERE,
    UNSEEN,
    fill_solid,
    hit,
    may_end,
    prepare,
    rough_distance,
    shade,
)

FloatArray = NDArray[np.float64]
Image = NDArray[np.float32]

TILE = 16
# Pixels this close to an outline are integrated: outside it the box filter's reach counts, inside
# the steep shading of a limb too, which falls off as a square root.
_OUTSIDE_PX, _INSIDE_PX = 0.75, 1.6
_ROUGHLY = 1.35  # how far rough_distance may be off
_NOTHING, _NEAR_OUTLINE = -1, -2


@jit
def render_rows(
    image: Image, row0: int, rays: Image, focal_px: float, poses: FloatArray, solids: FloatArray,
    light: FloatArray, ambient: float, greys: Image, texel_m: float, mean: np.float32,
    floor_poses: NDArray[np.int64],
) -> None:  # fmt: skip
    """Fill ``image`` (m, width) with the camera's rows from ``row0`` on.

    ``rays`` (2, height, width) are all pixels' normalised coordinates, ``poses`` (k, 4, 4) the
    sub-exposures, ``solids`` (n, 10) packed, ``greys`` the padded texture; ``floor_poses`` says
    which poses the floor away from outlines is averaged over.
    """
    k, n = poses.shape[0], solids.shape[0]
    size = int(np.sqrt(greys.size)) - 1
    rows = np.zeros((k, n, ROW))
    for i in range(k):
        for o in range(n):
            prepare(solids[o], poses[i], light, ambient, rows[i, o])
    margins = np.zeros(n)
    for o in range(n):
        margins[o] = 0.6 * _motion_px(rows[0, o], rows[k - 1, o], focal_px)
    views = [floor_view(poses[i], size, texel_m, focal_px) for i in range(k)]
    few_views = [views[i] for i in floor_poses]
    active = np.zeros(n, np.bool_)
    m, width = image.shape
    for v0 in range(0, m, TILE):
        v1 = min(v0 + TILE, m)
        band = rays[:, row0 + v0 : row0 + v1]
        empty_from = 0  # tiles without solids are filled together: long rows are faster
        for u0 in range(0, width, TILE):
            u1 = min(u0 + TILE, width)
            some = False
            for o in range(n):
                reach = (margins[o] + _OUTSIDE_PX) / focal_px
                active[o] = _tile_may_see(rows[k // 2, o], band[:, :, u0:u1], reach)
                some = some or active[o]
            if not some:
                continue
            floor = image[v0:v1, empty_from:u0]
            fill_floor(floor, band[:, :, empty_from:u0], few_views, greys, size, mean)
            empty_from = u1
            _solid_tile(
                image[v0:v1, u0:u1], row0 + v0, u0, rays, rows, active, margins,
                views, few_views, greys, size, mean, focal_px,
            )  # fmt: skip
        floor = image[v0:v1, empty_from:]
        fill_floor(floor, band[:, :, empty_from:], few_views, greys, size, mean)


@jit
def _motion_px(first: FloatArray, last: FloatArray, focal_px: float) -> float:
    """About how far, at most, an outline moves between two prepared rows of one solid."""
    if first[0] == UNSEEN or last[0] == UNSEEN:
        return 0.0
    most = 0.0
    if first[0] == SPHERE:
        d0 = np.sqrt(first[1] ** 2 + first[2] ** 2 + first[3] ** 2)
        d1 = np.sqrt(last[1] ** 2 + last[2] ** 2 + last[3] ** 2)
        for i in range(1, 4):
            most += (first[i] / d0 - last[i] / d1) ** 2
        return float(1.5 * focal_px * (np.sqrt(most) + abs(first[13] - last[13])))
    for o in (14, 17):
        change = 0.0
        for i in range(3):
            change += (first[o + i] - last[o + i]) ** 2
        most = max(most, np.sqrt(change))
    return float(1.5 * focal_px * most)


@jit
def _tile_may_see(row: FloatArray, rays: Image, margin: float) -> bool:
    """Whether a tile of ``rays`` (2, h, w) may touch the solid or ``margin`` around it."""
    if row[0] == UNSEEN:
        return False
    bottom, right = rays.shape[1] - 1, rays.shape[2] - 1
    cx = (rays[0, 0, 0] + rays[0, 0, right] + rays[0, bottom, 0] + rays[0, bottom, right]) / 4.0
    cy = (rays[1, 0, 0] + rays[1, 0, right] + rays[1, bottom, 0] + rays[1, bottom, right]) / 4.0
    reach = 0.0
    for i in (0, bottom):
        for j in (0, right):
            reach = max(reach, np.hypot(rays[0, i, j] - cx, rays[1, i, j] - cy))
    # Angles are at most distances in the plane z = 1; the factor covers the curved sides that
    # distortion gives a tile and the margin's pixels being wider there.
    slack = 1.5 * (reach + margin)
    norm = np.sqrt(cx * cx + cy * cy + 1.0)
    if row[0] == SPHERE:
        d = np.sqrt(row[1] ** 2 + row[2] ** 2 + row[3] ** 2)
        cosine = (cx * row[1] + cy * row[2] + row[3]) / (norm * d)
        return bool(np.arccos(min(max(cosine, -1.0), 1.0)) < np.arctan(row[13]) + slack)
    first = (cx * row[14] + cy * row[15] + row[16]) / norm
    second = (cx * row[17] + cy * row[18] + row[19]) / norm
    return bool(min(first, second) > -np.sin(min(slack, 1.5)))


@jit
def _solid_tile(
    tile: Image, v0: int, u0: int, rays: Image, rows: FloatArray, active: NDArray[np.bool_],
    margins: FloatArray, views: list[View], few_views: list[View], greys: Image, size: int,
    mean: np.float32, focal_px: float,
) -> None:  # fmt: skip
    """Render the tile at (v0, u0), in which the ``active`` solids may be seen."""
    k, n, middle = rows.shape[0], rows.shape[1], rows[rows.shape[0] // 2]
    J, layers = np.zeros(4), np.zeros((n, 3))
    edge, span = np.zeros(5), np.zeros(2)
    part = rays[:, v0 : v0 + tile.shape[0], u0 : u0 + tile.shape[1]]
    only = np.argmax(active)
    if np.sum(active) == 1 and _fills(middle[only], part, margins[only], focal_px, span):
        fill_solid(tile, part, middle[only])
        return
    for v in range(tile.shape[0]):
        for u in range(tile.shape[1]):
            x, y = float(rays[0, v0 + v, u0 + u]), float(rays[1, v0 + v, u0 + u])
            nearest = _plain_pixel(middle, active, margins, x, y, focal_px, layers, span)
            if nearest >= 0:
                tile[v, u] = layers[nearest, 2]
                continue
            total = 0.0
            if nearest == _NOTHING:
                for view in few_views:
                    total += float(
                        floor_grey(view, greys, size, mean, np.float32(x), np.float32(y))
                    )
                tile[v, u] = total / len(few_views)
                continue
            _jacobian(rays, v0 + v, u0 + u, J)
            for i in range(k):
                floor = floor_grey(views[i], greys, size, mean, np.float32(x), np.float32(y))
                total += pixel_at_outline(
                    rows[i], active, x, y, J, float(floor), focal_px, layers, edge, span
                )
            tile[v, u] = total / k


@jit
def _fills(
    row: FloatArray, rays: Image, margin_px: float, focal_px: float, span: FloatArray
) -> bool:
    """Whether all pixels of a tile of ``rays`` (2, h, w) lie well inside one solid's outline."""
    # Outlines are convex: the corners decide.
    for i in (0, rays.shape[1] - 1):
        for j in (0, rays.shape[2] - 1):
            x, y = rays[0, i, j], rays[1, i, j]
            if focal_px * rough_distance(row, x, y) < _ROUGHLY * (_INSIDE_PX + margin_px):
                return False
            # As if pixels were larger: the ends of a cylinder are further than a tile away.
            if may_end(row, span, hit(row, x, y, span), 4.0 * focal_px / TILE):
                return False
    return True


@jit
def _plain_pixel(
    rows: FloatArray, active: NDArray[np.bool_], margins: FloatArray, x: float, y: float,
    focal_px: float, layers: FloatArray, span: FloatArray,
) -> int:  # fmt: skip
    """The number of the solid that fills a pixel, its layer set; or one of the two below."""
    nearest = _NOTHING
    for o in range(rows.shape[0]):
        if not active[o]:
            continue
        row = rows[o]
        distance_px = focal_px * rough_distance(row, x, y)
        if distance_px < -_ROUGHLY * (_OUTSIDE_PX + margins[o]):
            continue
        if distance_px < _ROUGHLY * (_INSIDE_PX + margins[o]):
            return _NEAR_OUTLINE
        z = hit(row, x, y, span)
        if may_end(row, span, z, focal_px):
            return _NEAR_OUTLINE
        if nearest == _NOTHING or z < layers[nearest, 0]:
            nearest = o
            layers[o, 0], layers[o, 2] = z, shade(row, x, y, z)
    return nearest


@jit
def _jacobian(rays: Image, v: int, u: int, J: FloatArray) -> None:
    """d(x, y)/d(u, v) of the ray table at a pixel, by differences."""
    height, width = rays.shape[1], rays.shape[2]
    ua, ub = max(u - 1, 0), min(u + 1, width - 1)
    va, vb = max(v - 1, 0), min(v + 1, height - 1)
    J[0] = (rays[0, v, ub] - rays[0, v, ua]) / (ub - ua)
    J[2] = (rays[1, v, ub] - rays[1, v, ua]) / (ub - ua)
    J[1] = (rays[0, vb, u] - rays[0, va, u]) / (vb - va)
    J[3] = (rays[1, vb, u] - rays[1, va, u]) / (vb - va)
