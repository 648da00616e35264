"""A cylinder's two outline lines from edge candidates (compiled), and s and a from them.

A line is the unit normal n (3,) of the plane through the camera that touches the cylinder,
pointing to the axis' side: n.p = 0 on the line and n.P0 = R > 0.
"""

import numpy as np

from estimator.image.edges_profile import MAX_PEAKS
from estimator.image.edges_sphere import LCG_FACTOR, LCG_STEP, robust_scale
from estimator.image.intrinsics import FloatArray
from estimator.image.limb_linear import spread_through
from estimator.image.outline_normals import across
from estimator.jit import jit

_TRIALS = 100
_ENOUGH = 0.97
_TOLERANCE_PX = 1.5
_SOFT_GREY = 12.0
_FIT_STEPS = 6
_TUKEY = 4.685


@jit
def line_residual(ray: FloatArray, kappa: float, n: FloatArray) -> float:
    """Pixels by which a unit ray lies outside the line of n."""
    return float(-kappa * (ray[0] * n[0] + ray[1] * n[1] + ray[2] * n[2]))


@jit
def _score(
    rays: FloatArray, strengths: FloatArray, normals: FloatArray, n: FloatArray, to_beat: float
) -> float:
    """How well the normals agree on n; less than that once ``to_beat`` is out of reach."""
    total = 0.0
    for i in range(rays.shape[0]):
        best = 0.0
        for k in range(MAX_PEAKS):
            g = strengths[i, k]
            if g <= 0.0:
                break
            r = line_residual(rays[i, k], normals[i, 4], n) / _TOLERANCE_PX
            if abs(r) < 1.0:
                best = max(best, (1.0 - r * r) * g / (g + _SOFT_GREY))
        total += best
        if total + (rays.shape[0] - 1 - i) < to_beat:  # no normal counts for more than 1
            break
    return total


@jit
def _trial(
    rays: FloatArray, strengths: FloatArray, n0: FloatArray, draw: int
) -> tuple[FloatArray, bool]:
    """The line through two candidates at least a quarter of the length apart."""
    count = rays.shape[0]
    i = draw % count
    j = (i + count // 4 + (draw // 256) % (count // 2)) % count
    # Half of the draws take the strongest edge, the rest go down the list.
    ki = max(0, (draw // 65536) % (2 * MAX_PEAKS - 1) - MAX_PEAKS + 1)
    kj = max(0, (draw // 1048576) % (2 * MAX_PEAKS - 1) - MAX_PEAKS + 1)
    while ki > 0 and strengths[i, ki] <= 0.0:
        ki -= 1
    while kj > 0 and strengths[j, kj] <= 0.0:
        kj -= 1
    n = np.zeros(3)
    if strengths[i, ki] <= 0.0 or strengths[j, kj] <= 0.0:
        return n, False
    p, r = rays[i, ki], rays[j, kj]
    n[0] = p[1] * r[2] - p[2] * r[1]
    n[1] = p[2] * r[0] - p[0] * r[2]
    n[2] = p[0] * r[1] - p[1] * r[0]
    norm = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    if norm < 1e-9:
        return n, False
    if n[0] * n0[0] + n[1] * n0[1] + n[2] * n0[2] < 0.0:
        norm = -norm
    n /= norm
    return n, True


@jit
def consensus_line(
    rays: FloatArray, strengths: FloatArray, normals: FloatArray, n0: FloatArray, seed: int
) -> tuple[FloatArray, float]:
    """The unit n (3,) on which most normals agree, and its score (at most their number)."""
    count = rays.shape[0]
    best = n0.copy()
    score_best = _score(rays, strengths, normals, best, 0.0)
    state = np.uint64(seed * 2 + 1)
    for _ in range(_TRIALS):
        state = state * LCG_FACTOR + LCG_STEP
        n, usable = _trial(rays, strengths, n0, int(state >> np.uint64(30)))
        if not usable:
            continue
        score = _score(rays, strengths, normals, n, score_best)
        if score > score_best:
            score_best = score
            best = n
            if score > _ENOUGH * count:
                break
    return best, score_best


@jit
def nearest_line_peaks(
    rays: FloatArray, strengths: FloatArray, normals: FloatArray, n: FloatArray, gate_px: float
) -> tuple[FloatArray, FloatArray]:
    """Per normal the index (-1: none) and residual of the candidate nearest the line of n."""
    count = rays.shape[0]
    chosen = np.full(count, -1.0)
    residuals = np.full(count, np.nan)
    for i in range(count):
        nearest = gate_px
        for k in range(MAX_PEAKS):
            if strengths[i, k] <= 0.0:
                break
            r = line_residual(rays[i, k], normals[i, 4], n)
            if abs(r) < nearest:
                nearest = abs(r)
                chosen[i] = k
                residuals[i] = r
    return chosen, residuals


@jit
def fit_line(
    rays: FloatArray, strengths: FloatArray, normals: FloatArray, n0: FloatArray, gate_px: float
) -> tuple[FloatArray, FloatArray, FloatArray, float, bool]:
    """Robust least squares from n0: n, inverse normal matrix, residuals, scale, success.

    The inverse (3, 3) is zero along n; residuals (NaN: no edge within the gate) and scale in px,
    so the covariance of n is scale^2 times the inverse.
    """
    n = n0.copy()
    gate = gate_px
    scale = gate_px / _TUKEY
    inverse = np.zeros((3, 3))
    residuals = np.full(rays.shape[0], np.nan)
    for step in range(_FIT_STEPS):
        chosen, residuals = nearest_line_peaks(rays, strengths, normals, n, gate)
        scale = robust_scale(residuals)
        gate = max(1.0, min(gate, 3.0 * _TUKEY * scale))
        e1, e2 = across(n[0], n[1], n[2])
        m11, m12, m22, b1, b2 = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(rays.shape[0]):
            r = residuals[i] / (_TUKEY * scale)
            if not abs(r) < 1.0:
                continue
            ray = rays[i, int(chosen[i])]
            weight = (1.0 - r * r) ** 2
            kappa = normals[i, 4]
            j1 = kappa * (ray[0] * e1[0] + ray[1] * e1[1] + ray[2] * e1[2])
            j2 = kappa * (ray[0] * e2[0] + ray[1] * e2[1] + ray[2] * e2[2])
            m11 += weight * j1 * j1
            m12 += weight * j1 * j2
            m22 += weight * j2 * j2
            b1 += weight * j1 * residuals[i]
            b2 += weight * j2 * residuals[i]
        det = m11 * m22 - m12 * m12
        if not det > 1e-12 * m11 * m22:
            return n, inverse, residuals, scale, False
        d1 = (m22 * b1 - m12 * b2) / det
        d2 = (m11 * b2 - m12 * b1) / det
        for a in range(3):
            for c in range(3):
                inverse[a, c] = (
                    m22 * e1[a] * e1[c] - m12 * (e1[a] * e2[c] + e2[a] * e1[c])
                    + m11 * e2[a] * e2[c]
                ) / det  # fmt: skip
        n = n + d1 * e1 + d2 * e2
        n /= np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        if step > 1 and abs(d1) + abs(d2) < 1e-10:
            break
    _, residuals = nearest_line_peaks(rays, strengths, normals, n, gate_px)
    return n, inverse, residuals, scale, True


@jit
def cross(p: FloatArray, q: FloatArray) -> FloatArray:
    """p x q, all (3,)."""
    out = np.empty(3)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[i] = p[j] * q[k] - p[k] * q[j]
    return out


@jit
def cylinder_of_lines(n1: FloatArray, n2: FloatArray) -> tuple[FloatArray, FloatArray]:
    """s (3,) and unit axis a (3,) from the two unit normals towards the axis; eqs. (15)-(18)."""
    delta = 0.5 * (n1 + n2)
    a = cross(n2, n1)
    s = delta / (delta[0] ** 2 + delta[1] ** 2 + delta[2] ** 2)
    return s, a / np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)


@jit
def lines_of_cylinder(s: FloatArray, axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The unit normals n1, n2 (3,) of a cylinder's tangent planes; eq. (15) divided by R^2."""
    ss = s[0] ** 2 + s[1] ** 2 + s[2] ** 2
    b = np.sqrt(max(ss - 1.0, 0.0)) * cross(s, axis)
    return (s - b) / ss, (s + b) / ss


@jit
def cylinder_covariance(
    n1: FloatArray, n2: FloatArray, covariance_1: FloatArray, covariance_2: FloatArray
) -> FloatArray:
    """Covariance (3, 3) of s from those of the two independent normals; derivative of (16)."""
    delta = 0.5 * (n1 + n2)
    dd = delta[0] ** 2 + delta[1] ** 2 + delta[2] ** 2
    return spread_through(delta, 0.5 / dd, -1.0 / dd**2, covariance_1 + covariance_2)
