"""What the edges found along an outline look like as a whole (compiled)."""

import numpy as np

from estimator.image.edges_camera import GreyImage, normalised_of
from estimator.image.edges_profile import (
    NOISE_MOST_PX,
    BoolArray,
    expected_noise_px,
    stands_out_deep,
)
from estimator.image.intrinsics import FloatArray
from estimator.image.limb_linear import cholesky, solve_column
from estimator.jit import jit, jit_sums

_DEPTH_PX = 10.0
_RIDGE = 2.0
_LEAST_AGREE_PX, _MOST_AGREE_PX, _AGREE_SCALES = 0.6, 1.5, 4.0


@jit
def appearance(
    image: GreyImage, normals: FloatArray, residuals_px: FloatArray, scale_px: float, sign: float
) -> tuple[BoolArray, float, float, float]:
    """Which normals (n,) carry an edge where the outline says, and what goes with it.

    Then the share of them, the mean scatter that the surroundings make one expect, and the share
    of normals behind which the target's inside stands out too, not only its rim.
    """
    count = normals.shape[0]
    expected = expected_noise_px(image, normals, sign)
    deep = stands_out_deep(image, normals, sign, _DEPTH_PX)
    limit = min(max(_AGREE_SCALES * scale_px, _LEAST_AGREE_PX), _MOST_AGREE_PX)
    agreeing = np.zeros(count, np.bool_)
    share = expected_px = deep_share = 0.0
    for i in range(count):
        # False for NaN, where there is no edge.
        agreeing[i] = abs(residuals_px[i]) < limit and expected[i] < NOISE_MOST_PX
        share += 1.0 if agreeing[i] else 0.0
        expected_px += expected[i]
        deep_share += 1.0 if deep[i] else 0.0
    return agreeing, share / count, expected_px / count, deep_share / count


@jit
def longest_gap(agreeing: BoolArray, closed: bool) -> float:
    """The longest run without agreement, as a share of all."""
    count = agreeing.shape[0]
    longest = run = 0
    for i in range(2 * count if closed else count):
        run = 0 if agreeing[i % count] else run + 1
        longest = max(longest, run)
    return float(min(longest, count) / count)


@jit_sums
def bends_px(
    residuals_px: FloatArray, agreeing: BoolArray, shapes: FloatArray, free: int, few: int
) -> tuple[float, float]:
    """Size of the residuals' part along ``shapes`` (k, n) beyond the first ``free`` ones.

    First of a fit of the ``few`` first shapes alone, then of all of them.
    """
    count, places = shapes.shape
    shown = np.empty(places)
    m, rhs = np.zeros((count, count)), np.zeros((count, 2))
    for j in range(count):
        for i in range(places):
            shown[i] = shapes[j, i] if agreeing[i] else 0.0
            rhs[j, 0] += shown[i] * residuals_px[i] if agreeing[i] else 0.0
        rhs[j, 1] = rhs[j, 0]
        for k in range(j + 1):
            total = 0.0
            for i in range(places):
                total += shown[i] * shapes[k, i]
            m[j, k] = total
        # The ridge keeps waves small that only the gaps in the outline could tell.
        m[j, j] += _RIDGE
    cholesky(m)
    solve_column(m[:few, :few], rhs[:few], 0)
    solve_column(m, rhs, 1)
    bend_few = bend_all = 0.0
    for j in range(free, count):
        bend_few += rhs[j, 0] ** 2 if j < few else 0.0
        bend_all += rhs[j, 1] ** 2
    return np.sqrt(bend_few), np.sqrt(bend_all)


@jit
def round_place(normals: FloatArray, width: int, height: int) -> tuple[float, float]:
    """A round outline's mean radius and its distance from the image's border in px."""
    cu, cv = np.mean(normals[:, 0]), np.mean(normals[:, 1])
    radius, border = 0.0, np.inf
    for i in range(normals.shape[0]):
        u, v = normals[i, 0], normals[i, 1]
        radius += np.sqrt((u - cu) ** 2 + (v - cv) ** 2) / normals.shape[0]
        border = min(border, u, v, width - 1.0 - u, height - 1.0 - v)
    return radius, border


@jit
def facing(one: FloatArray, other: FloatArray) -> tuple[float, float, float]:
    """How two lines of normals (n, 5) run alongside each other.

    The cosine between their normals (-1: they face each other), the least of their distances at
    the ends over the greatest (negative: they cross), and the greatest in px.
    """
    aligned = one[0, 2] * other[0, 2] + one[0, 3] * other[0, 3]
    taper, width_px = np.inf, np.inf
    for turn in range(2):
        here, there = (one, other) if turn == 0 else (other, one)
        least, most = np.inf, -np.inf
        for end in (0, -1):
            du, dv = there[end, 0] - here[end, 0], there[end, 1] - here[end, 1]
            apart_px = -(du * here[end, 2] + dv * here[end, 3])
            least, most = min(least, apart_px), max(most, apart_px)
        taper = min(taper, least / most if most > 0.0 else -np.inf)
        width_px = min(width_px, most)
    return aligned, taper, width_px


@jit
def cone_shift_px(camera: FloatArray, normals: FloatArray, s: FloatArray) -> float:
    """How far the outline of the sphere at s (3,) lies from where the normals start, at most."""
    q = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2 - 1.0)
    most = 0.0
    for i in range(normals.shape[0]):
        x, y = normalised_of(camera, normals[i, 0], normals[i, 1])
        along = (x * s[0] + y * s[1] + s[2]) / np.sqrt(x * x + y * y + 1.0)
        most = max(most, abs(normals[i, 4] * (q - along)))
    return most


@jit
def line_shift_px(camera: FloatArray, normals: FloatArray, n: FloatArray) -> float:
    """How far the line of n (3,) lies from where the normals start, at most."""
    most = 0.0
    for i in range(normals.shape[0]):
        x, y = normalised_of(camera, normals[i, 0], normals[i, 1])
        across = (x * n[0] + y * n[1] + n[2]) / np.sqrt(x * x + y * y + 1.0)
        most = max(most, abs(normals[i, 4] * across))
    return most
