"""Collecting the pixels near an outline: their rays, their grey and the sector they belong to."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.cone import distance, outline_frame
from estimator.image.intrinsics import FloatArray
from estimator.jit import jit

# Rows of the collected pixels: ray and its Jacobian, grey, place along the sector, place in the
# image; then, filled by `locate`, distance to the outline, inward normal, curvature, derivatives by
# the geometry; then the distance to where the outline has moved since; last, zero or filled by
# `predict_clutter`, what the background's grey is about its level, and the variance of that.
X, Y, J0, J1, J2, J3, GREY, TAU, U, V, DISTANCE, NU, NV, BEND, GEOMETRY = range(15)
HERE, CLUTTER, CLUTTER_VARIANCE, SHADE, SHADE_SLOPE, ROWS = 18, 19, 20, 21, 22, 23
_COARSE_PX, _TILE_PX, _SMALL_TILE_PX = 32, 8, 2
_NEWTON_STEPS = 12
_MOST_SECTORS = 512
_LAYERS = 48  # a sector's pixels are sorted by distance this finely


@jit
def ray_of_pixel(u: float, v: float, camera: FloatArray, out: FloatArray) -> None:
    """Normalised position and its Jacobian (x, y, dx/du, dx/dv, dy/du, dy/dv) into ``out`` (6,).

    ``camera`` (9,) is fx, fy, cx, cy, k1, k2, p1, p2, k3. Newton on the Brown-Conrady map, started
    from what ``out`` holds (a neighbour's ray) so that one or two steps suffice.
    """
    fx, fy = camera[0], camera[1]
    xd, yd = (u - camera[2]) / fx, (v - camera[3]) / fy
    k1, k2, p1, p2, k3 = camera[4], camera[5], camera[6], camera[7], camera[8]
    if k1 == 0.0 and k2 == 0.0 and p1 == 0.0 and p2 == 0.0 and k3 == 0.0:
        out[0], out[1], out[2], out[3], out[4], out[5] = xd, yd, 1.0 / fx, 0.0, 0.0, 1.0 / fy
        return
    x, y = out[0], out[1]
    a = b = c = det = 1.0
    for _ in range(_NEWTON_STEPS):
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3))
        ex = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) - xd
        ey = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y - yd
        a = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
        b = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
        c = radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
        det = a * c - b * b
        dx, dy = (c * ex - b * ey) / det, (a * ey - b * ex) / det
        x -= dx
        y -= dy
        if dx * dx + dy * dy < 1e-18:
            break
    out[0], out[1] = x, y
    out[2], out[3], out[4], out[5] = (
        c / (det * fx),
        -b / (det * fy),
        -b / (det * fx),
        a / (det * fy),
    )


@jit
def collect(
    image: NDArray[np.uint8], camera: FloatArray, s: FloatArray, a: FloatArray,
    inner_px: float, outer_px: float, sector_px: float,
) -> tuple[FloatArray, NDArray[np.int64]]:  # fmt: skip
    """Pixels from ``outer_px`` outside to ``inner_px`` inside the outline of (s, a), by sector.

    Returns the pixels (ROWS, n), in each sector from the outside inwards, and the first index of
    each sector (sectors + 1,). A sector is about ``sector_px`` of the outline's length; TAU runs
    from -0.5 to 0.5 along it.
    """
    height, width = image.shape
    frame = outline_frame(s, a)
    sphere = a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0
    guide = _sector_guide(camera, s, frame, sphere, sector_px, height, width)
    # Half as much again as the band's area; lines may cross the image obliquely.
    most = int(1.6 * (guide[6] + 50.0) * (inner_px + outer_px + 2.0))
    found = np.empty((most, 3), dtype=np.int64)
    taus = np.empty(most)
    # In the target's middle the distance is meaningless: never skip far there.
    inside_skip = 0.4 * camera[0] / np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2 - 1.0)
    tile = _TILE_PX if inside_skip > 1.5 * _TILE_PX else _SMALL_TILE_PX
    count = 0
    near = np.empty(5)
    ray = np.zeros(6)
    for block in range(((height - 1) // _COARSE_PX + 1) * ((width - 1) // _COARSE_PX + 1)):
        across = (width - 1) // _COARSE_PX + 1
        top, left = block // across * _COARSE_PX, block % across * _COARSE_PX
        _look(top, left, _COARSE_PX, camera, s, a, ray, near)
        if _beyond(near[0], inner_px, outer_px, inside_skip) > 0.75 * _COARSE_PX:
            continue
        for v in range(top, min(top + _COARSE_PX, height), tile):
            for u in range(left, min(left + _COARSE_PX, width), tile):
                _look(v, u, tile, camera, s, a, ray, near)
                if _beyond(near[0], inner_px, outer_px, inside_skip) > 0.75 * tile:
                    continue
                count = _take(
                    v, u, tile, height, width, near, ray, inner_px, outer_px, guide, s, frame,
                    sphere, found, taus, count,
                )  # fmt: skip
    return _by_sector(image, camera, found[:count], taus, int(guide[5]))


@jit
def _look(
    top: int, left: int, size: int, camera: FloatArray, s: FloatArray, a: FloatArray,
    ray: FloatArray, near: FloatArray,
) -> None:  # fmt: skip
    """`distance` at the middle of a square of pixels into ``near`` (5,)."""
    middle = 0.5 * (size - 1)
    ray_of_pixel(left + middle, top + middle, camera, ray)
    near[0], near[1], near[2], near[3], near[4] = distance(
        ray[0], ray[1], ray[2], ray[3], ray[4], ray[5], s, a
    )


@jit
def _beyond(d: float, inner_px: float, outer_px: float, inside_skip: float) -> float:
    """How far outside the band a place at distance ``d`` surely is."""
    return min(d - inner_px, inside_skip) if d > 0.0 else -outer_px - d


@jit
def _take(
    top: int, left: int, tile: int, height: int, width: int, near: FloatArray, ray: FloatArray,
    inner_px: float, outer_px: float, guide: FloatArray, s: FloatArray, frame: FloatArray,
    sphere: bool, found: NDArray[np.int64], taus: FloatArray, count: int,
) -> int:  # fmt: skip
    """Note index, sector and TAU of a tile's pixels in the band; the new count."""
    middle = 0.5 * (tile - 1)
    cu, cv = left + middle - guide[0], top + middle - guide[1]
    sectors = int(guide[5])
    per_side = sectors // 2
    second = 0
    if sphere:
        start = np.arctan2(cv, cu) + np.pi
    else:
        start = 0.5 * per_side + (cu * guide[2] + cv * guide[3]) * guide[4]
        if not ray[0] * frame[1, 0] + ray[1] * frame[1, 1] + frame[1, 2] > 0.0:
            second = per_side
    d, nu, nv, bend = near[0], near[1], near[2], near[3]
    per_layer = _LAYERS / (inner_px + outer_px)
    for v in range(top, min(top + tile, height)):
        for u in range(left, min(left + tile, width)):
            du, dv = u - left - middle, v - top - middle
            t = nu * dv - nv * du
            here = d + nu * du + nv * dv - 0.5 * bend * t * t
            if here < -outer_px or here > inner_px or count == found.shape[0]:
                continue
            if sphere:
                # Angle from the tile's middle: its tangent is small, its arc two terms of it.
                x = (cu * dv - cv * du) / (cu * (cu + du) + cv * (cv + dv))
                place = (start + x - x * x * x / 3.0) * guide[4]
                place = place - sectors if place >= sectors else place
                place = place + sectors if place < 0.0 else place
                sector = min(int(place), sectors - 1)
            else:
                place = start + (du * guide[2] + dv * guide[3]) * guide[4]
                sector = min(max(int(place), 0), per_side - 1)
            layer = int((here + outer_px) * per_layer)
            found[count, 0], found[count, 1] = u, v
            found[count, 2] = (sector + second) * _LAYERS + min(layer, _LAYERS - 1)
            taus[count] = place - sector - 0.5
            count += 1
    return count


@jit
def _sector_guide(
    camera: FloatArray, s: FloatArray, frame: FloatArray, sphere: bool, sector_px: float,
    height: int, width: int,
) -> FloatArray:  # fmt: skip
    """What `_sector_of` needs: centre u, v, direction u, v, scale, sectors, length in px."""
    guide = np.zeros(7)
    guide[0] = camera[0] * s[0] / s[2] + camera[2]
    guide[1] = camera[1] * s[1] / s[2] + camera[3]
    if sphere:
        k = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2 - 1.0)
        round_px = 2.0 * np.pi * 0.5 * (camera[0] + camera[1]) / k
        guide[5] = min(max(12.0, np.rint(round_px / sector_px)), float(_MOST_SECTORS))
        guide[4] = guide[5] / (2.0 * np.pi)
        guide[6] = round_px
        return guide
    # The axis' direction in the image at s.
    du = camera[0] * (frame[0, 0] - frame[0, 2] * s[0] / s[2])
    dv = camera[1] * (frame[0, 1] - frame[0, 2] * s[1] / s[2])
    norm = np.sqrt(du * du + dv * dv) + 1e-300
    guide[2], guide[3] = du / norm, dv / norm
    guide[0], guide[1] = 0.5 * (width - 1), 0.5 * (height - 1)
    reach = 0.5 * (abs(guide[2]) * width + abs(guide[3]) * height)
    per_side = min(max(6.0, np.rint(2.0 * reach / sector_px)), 0.5 * _MOST_SECTORS)
    guide[4] = per_side / (2.0 * reach)
    guide[5] = 2.0 * per_side
    guide[6] = 4.0 * reach
    return guide


@jit
def _by_sector(
    image: NDArray[np.uint8], camera: FloatArray, found: NDArray[np.int64], taus: FloatArray,
    sectors: int,
) -> tuple[FloatArray, NDArray[np.int64]]:  # fmt: skip
    """The found pixels with their rays and grey, so that each sector's are contiguous."""
    place = np.zeros(sectors * _LAYERS + 1, dtype=np.int64)
    for i in range(found.shape[0]):
        place[found[i, 2] + 1] += 1
    for k in range(sectors * _LAYERS):
        place[k + 1] += place[k]
    starts = place[::_LAYERS].copy()
    order = np.empty(found.shape[0], dtype=np.int64)
    for i in range(found.shape[0]):
        order[place[found[i, 2]]] = i
        place[found[i, 2]] += 1
    pixels = np.empty((ROWS, found.shape[0]))
    ray = np.zeros(6)
    for at in range(found.shape[0]):
        i = order[at]
        u, v = found[i, 0], found[i, 1]
        ray_of_pixel(float(u), float(v), camera, ray)
        for j in range(6):
            pixels[j, at] = ray[j]
        pixels[GREY, at] = image[v, u]
        pixels[TAU, at] = taus[i]
        pixels[U, at], pixels[V, at] = u, v
        pixels[CLUTTER, at] = pixels[CLUTTER_VARIANCE, at] = 0.0
        pixels[SHADE, at] = pixels[SHADE_SLOPE, at] = 0.0
    return pixels, starts


@jit
def thinned(
    pixels: FloatArray, starts: NDArray[np.int64], stride: int
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Every ``stride``-th of each sector's pixels, as `collect` returns them (not located)."""
    some_starts = np.zeros_like(starts)
    for k in range(starts.shape[0] - 1):
        some_starts[k + 1] = some_starts[k] + (starts[k + 1] - starts[k] + stride - 1) // stride
    some = np.zeros((ROWS, some_starts[-1]))
    for j in range(DISTANCE):
        for k in range(starts.shape[0] - 1):
            at = starts[k] - some_starts[k] * stride
            for i in range(some_starts[k], some_starts[k + 1]):
                some[j, i] = pixels[j, at + i * stride]
    return some, some_starts
