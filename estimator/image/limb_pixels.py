"""Collecting the pixels near an outline: their rays, their grey and the sector they belong to."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.cone import distance, outline_frame
from estimator.image.intrinsics import FloatArray
from estimator.jit import jit

# Columns of a collected pixel.
X, Y, J0, J1, J2, J3, GREY, SECTOR, TAU, DISTANCE, COLUMNS = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
_NEWTON_STEPS = 12
_MOST_SECTORS = 256


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
    image: NDArray[np.uint8],
    camera: FloatArray,
    s: FloatArray,
    a: FloatArray,
    inner_px: float,
    outer_px: float,
    sector_px: float,
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Pixels from ``outer_px`` outside to ``inner_px`` inside the outline of (s, a), by sector.

    Of a cylinder, whose outline is long, about half of the pixels are taken, without a pattern:
    a chessboard would meet lines at 45 degrees always in the same phase. Returns the pixels (n,
    COLUMNS) and the first index of each sector (sectors + 1,). A sector is about ``sector_px`` of
    the outline's length; TAU runs from -0.5 to 0.5 along it.
    """
    height, width = image.shape
    count = 0
    frame = outline_frame(s, a)
    sphere = a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0
    guide = _sector_guide(camera, s, frame, sphere, sector_px, height, width)
    sectors = int(guide[5])
    # Half as much again as the band's area; lines may cross the image obliquely.
    density = 1.5 if sphere else 0.8
    found = np.empty((int(density * (guide[6] + 50.0) * (inner_px + outer_px + 2.0)), COLUMNS))
    # In the target's middle the distance is meaningless: never skip far there.
    k = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2 - 1.0)
    inside_skip = max(0.4 * camera[0] / k, 1.0)
    ray = np.zeros(6)
    row = 0
    while row < height:
        col = 0
        nearest = 1e9
        ray[0], ray[1] = -camera[2] / camera[0], (row - camera[3]) / camera[1]
        while col < width:
            ray_of_pixel(float(col), float(row), camera, ray)
            d, _, _, _, _ = distance(ray[0], ray[1], ray[2], ray[3], ray[4], ray[5], s, a)
            beyond = min(d - inner_px, inside_skip) if d > 0.0 else -outer_px - d
            nearest = min(nearest, beyond)
            if beyond > 0.0:
                col += max(1, int(0.8 * beyond))
                continue
            if count < found.shape[0]:
                for j in range(6):
                    found[count, j] = ray[j]
                found[count, GREY] = image[row, col]
                sector, tau = _sector_of(float(col), float(row), ray, guide, s, frame, sphere)
                found[count, SECTOR] = sector
                found[count, TAU] = tau
                found[count, DISTANCE] = d
                count += 1
            col += 1
            while not sphere and not _drawn(row, col):
                col += 1
        row += 1 if nearest <= 0.0 else max(1, int(0.8 * nearest))
    return _by_sector(found[:count], sectors)


@jit
def _drawn(row: int, col: int) -> bool:
    """Whether a pixel belongs to the fixed, patternless half of the image."""
    mixed = (row * 0x9E3779B1 + col * 0x85EBCA6B) & 0xFFFFFFFF
    mixed = ((mixed ^ (mixed >> 15)) * 0x2C1B3C6D) & 0xFFFFFFFF
    return bool((mixed >> 16) & 1)


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
def _sector_of(
    u: float, v: float, ray: FloatArray, guide: FloatArray, s: FloatArray, frame: FloatArray,
    sphere: bool,
) -> tuple[int, float]:  # fmt: skip
    """The sector of a pixel and where in it (-0.5 to 0.5) it lies."""
    du, dv = u - guide[0], v - guide[1]
    if sphere:
        place = (np.arctan2(dv, du) + np.pi) * guide[4]
        sector = min(int(place), int(guide[5]) - 1)
        return sector, place - sector - 0.5
    per_side = int(guide[5]) // 2
    place = (du * guide[2] + dv * guide[3]) * guide[4] + 0.5 * per_side
    sector = min(max(int(place), 0), per_side - 1)
    tau = place - sector - 0.5
    across = ray[0] * frame[1, 0] + ray[1] * frame[1, 1] + frame[1, 2]
    return (sector if across > 0.0 else sector + per_side), tau


@jit
def _by_sector(found: FloatArray, sectors: int) -> tuple[FloatArray, NDArray[np.int64]]:
    """``found`` reordered so that each sector's pixels are contiguous."""
    starts = np.zeros(sectors + 1, dtype=np.int64)
    for i in range(found.shape[0]):
        starts[int(found[i, SECTOR]) + 1] += 1
    for k in range(sectors):
        starts[k + 1] += starts[k]
    place = starts.copy()
    ordered = np.empty_like(found)
    for i in range(found.shape[0]):
        k = int(found[i, SECTOR])
        for j in range(COLUMNS):
            ordered[place[k], j] = found[i, j]
        place[k] += 1
    return ordered, starts


@jit
def refresh_distances(pixels: FloatArray, s: FloatArray, a: FloatArray) -> None:
    """Put each pixel's distance to the outline of (s, a) into its DISTANCE column."""
    for i in range(pixels.shape[0]):
        pixels[i, DISTANCE] = distance(
            pixels[i, X], pixels[i, Y], pixels[i, J0], pixels[i, J1], pixels[i, J2], pixels[i, J3],
            s, a,
        )[0]  # fmt: skip
