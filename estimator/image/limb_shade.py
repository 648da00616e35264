"""How a cylinder's shading goes on to its outline, told from the light on its body (compiled).

Under light from afar a body's grey depends on its normal alone: a level, and the part of the light
that falls on it, zero where the light comes from behind. A cylinder turns all its normals to a
camera that sees both sides, so what the light does in the last few pixels before an outline, where
blur hides it and a normal turns fast, can be read off the pixels between them.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.image.cone import outline_frame
from estimator.image.edges_camera import GreyImage, bilinear, pixel_of
from estimator.image.intrinsics import FloatArray
from estimator.image.limb_light import ANGLE, BINS, COLUMNS, COUNT, GREY, light_on, lit
from estimator.image.limb_pixels import (
    DISTANCE,
    GEOMETRY,
    NU,
    NV,
    SHADE,
    SHADE_SLOPE,
    U,
    V,
    X,
    Y,
)
from estimator.jit import jit

_ACROSS = 36  # samples between the sides per sector
_LEAST_PIXELS = 8
_BEYOND_PX = 0.5  # further inside than the edge reaches
_CELL_PX = 0.25  # of the table of the blurred shading
_MOST_CELLS = 256
_ALIKE = 3  # neighbouring sectors see the body about as large, and share a table


@jit
def predict_shading(
    image: GreyImage, camera: FloatArray, pixels: FloatArray, starts: NDArray[np.int64],
    s: FloatArray, a: FloatArray, blur: FloatArray, turn_rad: float, reach_px: float,
) -> bool:  # fmt: skip
    """Fill the rows SHADE and SHADE_SLOPE of the pixels located at the cylinder (s, a).

    Their grey inside is expected to be SHADE + SHADE_SLOPE times the distance above what it is at
    the outline. ``reach_px`` inside the outline the image is pure foreground. False, with nothing
    filled, where too little of the body is in view, or it is not lit like a plain surface.
    """
    per_side = (starts.shape[0] - 1) // 2
    length = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
    bins = np.zeros((BINS, COLUMNS))
    frame = outline_frame(s, a)
    for k in range(per_side):
        _sample(image, camera, pixels, starts, k, per_side, s, a, frame, reach_px, bins)
    light, known = light_on(bins)
    if not known:
        return False
    limb = 0.5 * np.pi - np.arcsin(1.0 / length)
    table = np.empty(_MOST_CELLS)
    for side in range(2):
        towards = 1.0 if side == 0 else -1.0
        for k in range(0, per_side, _ALIKE):
            first = starts[side * per_side + k]
            last = starts[side * per_side + min(k + _ALIKE, per_side)]
            if last > first:
                _fill(pixels, first, last, light, limb, towards, length, blur, turn_rad, table)
    return True


@jit
def _sample(
    image: GreyImage, camera: FloatArray, pixels: FloatArray, starts: NDArray[np.int64], k: int,
    per_side: int, s: FloatArray, a: FloatArray, frame: FloatArray, reach_px: float,
    bins: FloatArray,
) -> None:  # fmt: skip
    """Add what is seen between the k-th sectors of both sides: number, angle and grey by bin."""
    i0, i1 = starts[k], starts[k + 1]
    j0, j1 = starts[k + per_side], starts[k + per_side + 1]
    if i1 - i0 < _LEAST_PIXELS or j1 - j0 < _LEAST_PIXELS:
        return
    x0, y0 = np.mean(pixels[X, i0:i1]), np.mean(pixels[Y, i0:i1])
    x1, y1 = np.mean(pixels[X, j0:j1]), np.mean(pixels[Y, j0:j1])
    du = np.mean(pixels[U, i0:i1]) - np.mean(pixels[U, j0:j1])
    dv = np.mean(pixels[V, i0:i1]) - np.mean(pixels[V, j0:j1])
    margin = (reach_px + _BEYOND_PX) / np.sqrt(du * du + dv * dv)
    length = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
    for m in range(_ACROSS):
        share = margin + (1.0 - 2.0 * margin) * (m + 0.5) / _ACROSS
        x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
        u, v = pixel_of(camera, x, y)
        grey = bilinear(image, u, v)
        across = x * frame[1, 0] + y * frame[1, 1] + frame[1, 2]
        forward = x * frame[2, 0] + y * frame[2, 1] + frame[2, 2]
        theta = np.arctan2(across, forward)
        off = length * np.sin(theta)
        if not abs(off) < 1.0 or not grey >= 0.0:
            continue
        angle = np.arcsin(off) - theta  # of the normal from the direction towards the camera
        at = min(int((angle / np.pi + 0.5) * BINS), BINS - 1)
        bins[at, COUNT] += 1.0
        bins[at, ANGLE] += angle
        bins[at, GREY] += grey


@jit
def _fill(
    pixels: FloatArray, start: int, stop: int, light: FloatArray, limb_rad: float, towards: float,
    length: float, blur: FloatArray, turn_rad: float, table: FloatArray,
) -> None:  # fmt: skip
    """The blurred shading at the pixels of some neighbouring sectors."""
    n = 1.0 / (stop - start)
    radius = nu = nv = 0.0
    least, most = np.inf, -np.inf
    for i in range(start, stop):
        radius -= n * pixels[GEOMETRY, i] * length
        nu += n * pixels[NU, i]
        nv += n * pixels[NV, i]
        least, most = min(least, pixels[DISTANCE, i]), max(most, pixels[DISTANCE, i])
    across = np.cos(turn_rad) * nu + np.sin(turn_rad) * nv
    motion = np.sqrt(max(blur[1] * across * across + blur[2] * across, 0.0))
    one, other = np.sqrt(nu * nu + blur[0]), np.sqrt(nv * nv + blur[0])
    beyond = 0.5 * (motion + one + other) + _CELL_PX
    first = least - beyond
    cells = min(int((most + beyond - first) / _CELL_PX) + 2, _MOST_CELLS)
    at_limb = lit(light, towards * limb_rad)
    for j in range(cells):
        d = first + (j + 0.5) * _CELL_PX
        table[j] = 0.0
        if d > 0.0:
            turned = np.arccos(max(1.0 - d / radius, 0.0))
            turned -= d / (radius * np.sqrt(length * length - 1.0))
            table[j] = lit(light, towards * (limb_rad - turned)) - at_limb
    for width in (motion, one, other):
        _box(table, cells, width / _CELL_PX)
    for i in range(start, stop):
        x = (pixels[DISTANCE, i] - first) / _CELL_PX - 0.5
        j = min(max(int(x), 0), cells - 2)
        slope = table[j + 1] - table[j]
        grey = table[j] + (x - j) * slope
        pixels[SHADE_SLOPE, i] = slope / _CELL_PX
        pixels[SHADE, i] = grey - slope / _CELL_PX * pixels[DISTANCE, i]


@jit
def _box(table: FloatArray, cells: int, width: float) -> None:
    """Average the first ``cells`` of ``table`` over ``width`` cells about each, in place."""
    if width < 1e-3:
        return
    total = np.empty(cells + 1)
    total[0] = 0.0
    for j in range(cells):
        total[j + 1] = total[j] + table[j]
    for j in range(cells):
        value = 0.0
        for end in (-1.0, 1.0):
            x = min(max(j + 0.5 + 0.5 * end * width, 0.0), float(cells))
            k = min(int(x), cells - 1)
            value += end * (total[k] + (x - k) * (total[k + 1] - total[k]))
        table[j] = value / width
