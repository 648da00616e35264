"""Long straight edges among edge pixels, by voting for direction and offset (compiled)."""

import numpy as np

from estimator.image.intrinsics import FloatArray
from estimator.jit import jit

_DIRECTIONS = 180  # over the full turn: an edge's bright side tells its direction's sign
_SPREAD = 3  # direction bins on either side that one edge votes for
_SOFT_GREY = 30.0
_FIT_STEPS = 3


@jit
def vote_lines(edges: FloatArray, radius: float, most: int) -> FloatArray:
    """Rough lines (n, 3): normal angle, offset, votes; x cos + y sin = offset, normal to bright.

    ``radius`` bounds the offsets; strongest first.
    """
    half = int(radius) + 2
    votes = np.zeros((_DIRECTIONS, 2 * half + 1))
    step = 2.0 * np.pi / _DIRECTIONS
    for e in range(edges.shape[0]):
        weight = edges[e, 4] / (edges[e, 4] + _SOFT_GREY)
        middle = int(np.round(np.arctan2(edges[e, 3], edges[e, 2]) / step))
        for k in range(-_SPREAD, _SPREAD + 1):
            angle = (middle + k) * step
            offset = edges[e, 0] * np.cos(angle) + edges[e, 1] * np.sin(angle) + half
            j = int(offset)
            if 0 <= j < 2 * half:
                share = offset - j
                votes[(middle + k) % _DIRECTIONS, j] += weight * (1.0 - share)
                votes[(middle + k) % _DIRECTIONS, j + 1] += weight * share
    found = np.zeros((most, 3))
    count = 0
    while count < most:
        flat = int(np.argmax(votes))
        a, j = flat // (2 * half + 1), flat % (2 * half + 1)
        if votes[a, j] <= 0.0:
            break
        found[count, 0], found[count, 1], found[count, 2] = a * step, j - half, votes[a, j]
        count += 1
        for k in range(-4, 5):
            votes[(a + k) % _DIRECTIONS, max(0, j - 1) : j + 2] = 0.0
    return found[:count]


@jit
def fit_edge_line(edges: FloatArray, rough: FloatArray) -> tuple[float, float, float]:
    """Normal angle, offset and summed weight of the line through the edges near a rough one."""
    angle, offset, total = rough[0], rough[1], 0.0
    gate = 2.5
    for _ in range(_FIT_STEPS):
        c, s = np.cos(angle), np.sin(angle)
        sw, st, sr, stt, str_ = 0.0, 0.0, 0.0, 0.0, 0.0
        for e in range(edges.shape[0]):
            r = edges[e, 0] * c + edges[e, 1] * s - offset
            if abs(r) > gate or edges[e, 2] * c + edges[e, 3] * s < 0.9:
                continue
            weight = edges[e, 4] / (edges[e, 4] + _SOFT_GREY) * (1.0 - (r / gate) ** 2)
            t = edges[e, 1] * c - edges[e, 0] * s
            sw += weight
            st += weight * t
            sr += weight * r
            stt += weight * t * t
            str_ += weight * t * r
        total = sw
        det = sw * stt - st * st
        if not det > 1e-9 * sw * stt:
            return angle, offset, 0.0
        slope = (sw * str_ - st * sr) / det
        angle -= np.arctan(slope)
        offset += (sr - slope * st) / sw
        gate = 1.6
    return angle, offset, total
