"""A sector's pixels parted into those across the outline and those on either side (compiled)."""

import numpy as np

from estimator.image.intrinsics import FloatArray
from estimator.image.limb_edge import (
    E_BEND,
    E_CLUTTER,
    E_CLUTTER_VARIANCE,
    E_D,
    E_GEOMETRY,
    E_NU,
    E_NV,
    E_SHADE,
    E_SHADE_SLOPE,
    E_TAU,
    MOST_PIXELS,
    R_GREY,
)
from estimator.image.limb_pixels import (
    BEND,
    CLUTTER,
    CLUTTER_VARIANCE,
    DISTANCE,
    GEOMETRY,
    GREY,
    HERE,
    NU,
    NV,
    SHADE,
    SHADE_SLOPE,
    TAU,
)
from estimator.jit import jit, jit_inlined, jit_sums


@jit
def reach_px(blur: FloatArray, margin_px: float, smooth: bool) -> float:
    """How far from an outline known to ``margin_px`` pixels still see both sides of it.

    ``smooth`` when the point spread is seen as a Gaussian, not as wider boxes.
    """
    width2 = blur[1] + abs(blur[2]) + blur[4] + abs(blur[5])
    still = 0.5 + 3.0 * np.sqrt(blur[0] / 6.0) if smooth else 0.5 * np.sqrt(blur[0] * 2.0 + 1.0)
    return float(margin_px + still + 0.5 * np.sqrt(max(width2, 0.0)))


@jit_sums
def parted(
    pixels: FloatArray, start: int, stop: int, moved_by: FloatArray, reach: float,
    edge: FloatArray, outside: FloatArray, inside: FloatArray,
) -> tuple[int, int, int]:  # fmt: skip
    """Copy a sector's pixels to those across the outline, outside and inside; their numbers.

    A sector's pixels come (almost) from the outside inwards; between the first and the last one
    within ``reach`` of the outline, all count as across it.
    """
    _copied(pixels, DISTANCE, start, stop - start, pixels[HERE, start:stop], 0)
    distances = pixels[HERE, start:stop]
    for j in range(moved_by.shape[0]):
        by, change = moved_by[j], pixels[GEOMETRY + j, start:stop]
        for i in range(distances.shape[0]):
            distances[i] += by * change[i]
    first, last = 0, distances.shape[0]
    while first < last and distances[first] < -reach:
        first += 1
    while last > first and distances[last - 1] > reach:
        last -= 1
    n_out, n_in = min(first, MOST_PIXELS), min(distances.shape[0] - last, MOST_PIXELS)
    n_edge = min(last - first, MOST_PIXELS)
    _copied(pixels, TAU, start, n_out, outside, MOST_PIXELS)
    _copied(pixels, HERE, start, n_out, outside, 2 * MOST_PIXELS)
    _copied(pixels, GREY, start, n_out, outside, 3 * MOST_PIXELS)
    _copied(pixels, TAU, start + last, n_in, inside, MOST_PIXELS)
    _copied(pixels, HERE, start + last, n_in, inside, 2 * MOST_PIXELS)
    _copied(pixels, GREY, start + last, n_in, inside, 4 * MOST_PIXELS)
    for i in range(n_out):
        outside[i] = 1.0
    for i in range(n_in):
        inside[i] = 1.0
        inside[3 * MOST_PIXELS + i] = np.sqrt(inside[2 * MOST_PIXELS + i])
        at = start + last + i
        shade = pixels[SHADE, at] + pixels[SHADE_SLOPE, at] * inside[2 * MOST_PIXELS + i]
        inside[4 * MOST_PIXELS + i] -= shade
    for j in range(moved_by.shape[0]):
        _copied(pixels, GEOMETRY + j, start + first, n_edge, edge, (E_GEOMETRY + j) * MOST_PIXELS)
    _copied(pixels, TAU, start + first, n_edge, edge, E_TAU * MOST_PIXELS)
    _copied(pixels, GREY, start + first, n_edge, edge, R_GREY * MOST_PIXELS)
    _copied(pixels, HERE, start + first, n_edge, edge, E_D * MOST_PIXELS)
    _copied(pixels, NU, start + first, n_edge, edge, E_NU * MOST_PIXELS)
    _copied(pixels, NV, start + first, n_edge, edge, E_NV * MOST_PIXELS)
    _copied(pixels, BEND, start + first, n_edge, edge, E_BEND * MOST_PIXELS)
    _copied(pixels, CLUTTER, start + first, n_edge, edge, E_CLUTTER * MOST_PIXELS)
    place = E_CLUTTER_VARIANCE * MOST_PIXELS
    _copied(pixels, CLUTTER_VARIANCE, start + first, n_edge, edge, place)
    _copied(pixels, SHADE, start + first, n_edge, edge, E_SHADE * MOST_PIXELS)
    _copied(pixels, SHADE_SLOPE, start + first, n_edge, edge, E_SHADE_SLOPE * MOST_PIXELS)
    return n_edge, n_out, n_in


@jit_inlined
def _copied(
    pixels: FloatArray, row: int, begin: int, count: int, to: FloatArray, place: int
) -> None:  # fmt: skip
    """Copy ``count`` pixels of one row from ``begin`` on to ``place``."""
    source, target = pixels[row, begin : begin + count], to[place : place + count]
    for i in range(count):
        target[i] = source[i]
