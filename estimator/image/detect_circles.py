"""Circles among edge pixels: votes along their gradients, an accumulator a radius (compiled)."""

import numpy as np

from estimator.image.edges_sphere import solve3
from estimator.image.intrinsics import FloatArray
from estimator.jit import jit

_RATIO = 1.2  # between neighbouring radius bins
_SOFT_GREY = 30.0
_LEAST_SHARE = 0.03
_PEAKS_PER_RADIUS = 4
_SECTORS = 36
_FIT_STEPS = 4


@jit
def _cells(radius: float) -> float:
    """The cell size for a radius: gradient directions are good to about a tenth of a radian."""
    return max(1.0, radius / 9.0)


@jit
def vote_circles(
    edges: FloatArray, low: float, high: float, sign: float, bounds: FloatArray, most: int
) -> FloatArray:
    """Rough circles (n, 4): x, y, radius, share of the outline that voted; best first.

    ``bounds`` is (x0, y0, x1, y1) of the plane; centres outside are not found.
    """
    bins = int(np.ceil(np.log(high / low) / np.log(_RATIO))) + 1
    found = np.zeros((bins * _PEAKS_PER_RADIUS, 4))
    count = 0
    for b in range(bins):
        radius = low * _RATIO**b
        cell = _cells(radius)
        columns = int((bounds[2] - bounds[0]) / cell) + 2
        rows = int((bounds[3] - bounds[1]) / cell) + 2
        votes = np.zeros((rows, columns))
        for e in range(edges.shape[0]):
            weight = edges[e, 4] / (edges[e, 4] + _SOFT_GREY)
            for k in range(-1, 2):
                r = sign * radius * (1.0 + 0.075 * k)
                j = int(np.floor((edges[e, 0] + r * edges[e, 2] - bounds[0]) / cell))
                i = int(np.floor((edges[e, 1] + r * edges[e, 3] - bounds[1]) / cell))
                if 0 <= i < rows and 0 <= j < columns:
                    votes[i, j] += weight
        # A vote falls anywhere in its cell, so peaks are sought over blocks of two by two.
        least = _LEAST_SHARE * 3.0 * 2.0 * np.pi * radius
        kept = 0
        while kept < _PEAKS_PER_RADIUS:
            best, bi, bj = least, -1, -1
            for i in range(rows - 1):
                for j in range(columns - 1):
                    total = votes[i, j] + votes[i, j + 1] + votes[i + 1, j] + votes[i + 1, j + 1]
                    if total > best:
                        best, bi, bj = total, i, j
            if bi < 0:
                break
            found[count, 0] = bounds[0] + (bj + 1.0) * cell
            found[count, 1] = bounds[1] + (bi + 1.0) * cell
            found[count, 2] = radius
            found[count, 3] = best / (3.0 * 2.0 * np.pi * radius)
            count += 1
            kept += 1
            votes[max(0, bi - 1) : bi + 3, max(0, bj - 1) : bj + 3] = 0.0
    # Long outlines are rarer by chance than short ones of the same share.
    order = np.argsort(-found[:count, 3] * np.sqrt(found[:count, 2]))[:most]
    return found[:count][order]


@jit
def fit_circle(
    edges: FloatArray, rough: FloatArray, sign: float
) -> tuple[float, float, float, float]:
    """x, y, radius and the share of sectors with an agreeing edge, from a rough circle (4,)."""
    x, y = rough[0], rough[1]
    r = _commonest_radius(edges, x, y, rough[2], sign)
    gate = max(2.0, 0.12 * r)
    seen = np.zeros(_SECTORS)
    ones = np.empty(3)
    for step in range(_FIT_STEPS):
        m = np.zeros((3, 3))
        b = np.zeros(3)
        seen[:] = 0.0
        for e in range(edges.shape[0]):
            dx, dy = edges[e, 0] - x, edges[e, 1] - y
            d = np.sqrt(dx * dx + dy * dy)
            if abs(d - r) > gate or d < 1.0:
                continue
            if -sign * (dx * edges[e, 2] + dy * edges[e, 3]) < 0.8 * d:
                continue
            weight = edges[e, 4] / (edges[e, 4] + _SOFT_GREY) * (1.0 - ((d - r) / gate) ** 2)
            seen[int((np.arctan2(dy, dx) / (2.0 * np.pi) + 0.5) * _SECTORS) % _SECTORS] = 1.0
            ones[0], ones[1], ones[2] = dx / d, dy / d, 1.0
            for a in range(3):
                b[a] += weight * ones[a] * (d - r)
                for c in range(3):
                    m[a, c] += weight * ones[a] * ones[c]
        change, _, regular = solve3(m, b)
        if not regular:
            return x, y, r, 0.0
        x, y, r = x + change[0], y + change[1], r + change[2]
        if not r > 1.0:
            return x, y, 1.0, 0.0
        gate = max(1.5, 0.6 * gate) if step < _FIT_STEPS - 1 else gate
    return x, y, r, float(np.mean(seen))


@jit
def _commonest_radius(edges: FloatArray, x: float, y: float, radius: float, sign: float) -> float:
    """The radius within a fifth of ``radius`` at which most edges face the centre."""
    size = max(1.0, 0.05 * radius)
    votes = np.zeros(int(0.5 * radius / size) + 3)
    for e in range(edges.shape[0]):
        dx, dy = edges[e, 0] - x, edges[e, 1] - y
        d = np.sqrt(dx * dx + dy * dy)
        if abs(d - radius) > 0.22 * radius + 1.0:
            continue
        if -sign * (dx * edges[e, 2] + dy * edges[e, 3]) < 0.8 * d:
            continue
        k = int((d - 0.78 * radius + 1.0) / size)
        if 0 <= k < votes.shape[0]:
            votes[k] += edges[e, 4] / (edges[e, 4] + _SOFT_GREY)
    best, place = 0.0, 0
    for k in range(votes.shape[0] - 1):
        if votes[k] + votes[k + 1] > best:
            best, place = votes[k] + votes[k + 1], k
    return 0.78 * radius - 1.0 + (place + 1.0) * size
