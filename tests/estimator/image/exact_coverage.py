"""The exact share of each pixel inside an outline, and the grey seen there (compiled)."""

import numpy as np
from numpy.typing import NDArray

from estimator.jit import jit

FloatArray = NDArray[np.float64]

CELLS = 4  # a pixel near the outline is cut into CELLS x CELLS


@jit
def expose(
    coverage: FloatArray, grey_sum: FloatArray, rays_x: FloatArray, rays_y: FloatArray,
    s: FloatArray, a: FloatArray, light: FloatArray, low: float, high: float, wrapped: bool,
) -> None:  # fmt: skip
    """Add one sub-exposure: each pixel's share inside the outline, and its grey times share."""
    height, width = coverage.shape
    n = rays_x.shape[0] // height
    for row in range(height):
        skip_to = 0
        for col in range(width):
            if col < skip_to:
                continue
            i, j = row * n + n // 2, col * n + n // 2
            d, _, _ = _distance_px(rays_x, rays_y, i, j, s, a)
            # Pixels well to one side need no cutting; far outside, neither do their neighbours.
            if d < -2.0:
                skip_to = col + int(-0.5 * d)
                continue
            if d > 2.0:
                x = 0.5 * (rays_x[i, j] + rays_x[i - 1, j - 1])
                y = 0.5 * (rays_y[i, j] + rays_y[i - 1, j - 1])
                coverage[row, col] += 1.0
                grey_sum[row, col] += _shade(x, y, s, a, light, low, high, wrapped)
                continue
            for i in range(row * n, row * n + n):
                for j in range(col * n, col * n + n):
                    d, gx, gy = _distance_px(rays_x, rays_y, i, j, s, a)
                    share = _half_plane_share(d * n, gx, gy) / (n * n)
                    if share > 0.0:
                        grey = _shade(rays_x[i, j], rays_y[i, j], s, a, light, low, high, wrapped)
                        coverage[row, col] += share
                        grey_sum[row, col] += share * grey


@jit
def _side(x: float, y: float, s: FloatArray, a: FloatArray) -> float:
    """Positive inside the outline: p.s - sqrt(|s|^2 - 1) |p normal to a|."""
    pa = x * a[0] + y * a[1] + a[2]
    across = x * x + y * y + 1.0 - pa * pa
    k2 = s[0] * s[0] + s[1] * s[1] + s[2] * s[2] - 1.0
    return float(x * s[0] + y * s[1] + s[2] - np.sqrt(k2 * across))


@jit
def _distance_px(
    rays_x: FloatArray, rays_y: FloatArray, i: int, j: int, s: FloatArray, a: FloatArray
) -> tuple[float, float, float]:  # fmt: skip
    """Distance to the outline in pixels, positive inside, and the unit direction inwards."""
    side = _side(rays_x[i, j], rays_y[i, j], s, a)
    # Differences between neighbouring cells contain the lens' distortion by themselves.
    di = 1 if i + 1 < rays_x.shape[0] else -1
    dj = 1 if j + 1 < rays_x.shape[1] else -1
    cells = float(CELLS)
    gx = cells * dj * (_side(rays_x[i, j + dj], rays_y[i, j + dj], s, a) - side)
    gy = cells * di * (_side(rays_x[i + di, j], rays_y[i + di, j], s, a) - side)
    norm = np.sqrt(gx * gx + gy * gy)
    return side / norm, gx / norm, gy / norm


@jit
def _half_plane_share(d: float, nx: float, ny: float) -> float:
    """Share of a unit square on the side n.x + d > 0 (x from its centre, n a unit vector)."""
    long, short = max(abs(nx), abs(ny)), min(abs(nx), abs(ny))
    reach = 0.5 * (long + short)
    if d >= reach:
        return 1.0
    if d <= -reach:
        return 0.0
    if abs(d) <= 0.5 * (long - short):
        return 0.5 + d / long
    rest = reach - abs(d)
    corner = rest * rest / (2.0 * long * short)
    return 1.0 - corner if d > 0.0 else corner


@jit
def _shade(
    x: float, y: float, s: FloatArray, a: FloatArray, light: FloatArray, low: float, high: float,
    wrapped: bool,
) -> float:  # fmt: skip
    """Grey where the ray (x, y, 1) first meets the unit surface around s."""
    if high == low:
        return high
    pa = x * a[0] + y * a[1] + a[2]
    px, py, pz = x - pa * a[0], y - pa * a[1], 1.0 - pa * a[2]
    pp = px * px + py * py + pz * pz
    ps = px * s[0] + py * s[1] + pz * s[2]
    k2 = s[0] * s[0] + s[1] * s[1] + s[2] * s[2] - 1.0
    t = (ps - np.sqrt(max(0.0, ps * ps - k2 * pp))) / pp
    nx, ny, nz = t * px - s[0], t * py - s[1], t * pz - s[2]
    norm = np.sqrt(nx * nx + ny * ny + nz * nz)
    lit = (nx * light[0] + ny * light[1] + nz * light[2]) / norm
    share = 0.5 * (1.0 + lit) if wrapped else max(0.0, lit)
    return float(low + (high - low) * share)
