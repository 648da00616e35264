"""A sphere's outline from edge candidates: consensus, then a robust fit of the cone (compiled).

The cone (p.s)^2 = (|s|^2 - 1)|p|^2 is a plane cut of the unit sphere of rays: with
w = s / sqrt(|s|^2 - 1) a unit ray p on the outline obeys p.w = 1, which is linear in w.
"""

import numpy as np

from estimator.image.edges_profile import MAX_PEAKS
from estimator.image.intrinsics import FloatArray
from estimator.image.limb_linear import spread_through
from estimator.jit import jit

_TRIALS = 150
_ENOUGH = 0.97
_TOLERANCE_PX = 1.5
_SOFT_GREY = 12.0  # edges weaker than about this count for less
_FIT_STEPS = 6
_TUKEY = 4.685
_LEAST_SCALE_PX = 0.08
LCG_FACTOR, LCG_STEP = np.uint64(6364136223846793005), np.uint64(1442695040888963407)


@jit
def solve3(m: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, bool]:
    """Solution of m x = b and the inverse of the symmetric m (3, 3); False when singular."""
    inverse = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            a, c = (i + 1) % 3, (i + 2) % 3
            d, e = (j + 1) % 3, (j + 2) % 3
            inverse[j, i] = m[a, d] * m[c, e] - m[a, e] * m[c, d]
    det = m[0, 0] * inverse[0, 0] + m[0, 1] * inverse[1, 0] + m[0, 2] * inverse[2, 0]
    scale = abs(m[0, 0] * m[1, 1] * m[2, 2]) + 1e-300
    if not abs(det) > 1e-14 * scale:
        return np.zeros(3), np.zeros((3, 3)), False
    inverse /= det
    x = np.empty(3)
    for i in range(3):
        x[i] = inverse[i, 0] * b[0] + inverse[i, 1] * b[1] + inverse[i, 2] * b[2]
    return x, inverse, True


@jit
def cone_residual(ray: FloatArray, kappa: float, w: FloatArray, q: float) -> float:
    """Pixels by which a unit ray lies outside the cone of w; q = sqrt(|w|^2 - 1)."""
    return float(kappa * (1.0 - ray[0] * w[0] - ray[1] * w[1] - ray[2] * w[2]) / q)


@jit
def _score(
    rays: FloatArray, strengths: FloatArray, normals: FloatArray, w: FloatArray, to_beat: float
) -> float:
    """How well the normals agree on w; less than that once ``to_beat`` is out of reach."""
    q = np.sqrt(max(w[0] ** 2 + w[1] ** 2 + w[2] ** 2 - 1.0, 1e-12))
    total = 0.0
    for i in range(rays.shape[0]):
        best = 0.0
        for k in range(MAX_PEAKS):
            g = strengths[i, k]
            if g <= 0.0:
                break
            r = cone_residual(rays[i, k], normals[i, 4], w, q) / _TOLERANCE_PX
            if abs(r) < 1.0:
                best = max(best, (1.0 - r * r) * g / (g + _SOFT_GREY))
        total += best
        if total + (rays.shape[0] - 1 - i) < to_beat:  # no normal counts for more than 1
            break
    return total


@jit
def _trial(
    rays: FloatArray, strengths: FloatArray, state: np.uint64
) -> tuple[np.uint64, FloatArray, bool]:
    """The generator's next state, and the cone through three candidates about 120 deg apart."""
    count = rays.shape[0]
    mtm, ones = np.zeros((3, 3)), np.zeros(3)
    state = state * LCG_FACTOR + LCG_STEP
    start = int((state >> np.uint64(33)) % np.uint64(count))
    for c in range(3):
        state = state * LCG_FACTOR + LCG_STEP
        draw = int(state >> np.uint64(40))
        i = (start + (c * count) // 3 + draw % (count // 6 + 1)) % count
        # Half of the draws take the strongest edge, the rest go down the list.
        k = max(0, (draw // 1024) % (2 * MAX_PEAKS - 1) - MAX_PEAKS + 1)
        while k > 0 and strengths[i, k] <= 0.0:
            k -= 1
        if strengths[i, k] <= 0.0:
            return state, ones, False
        for a in range(3):
            ones[a] += rays[i, k, a]
            for b in range(3):
                mtm[a, b] += rays[i, k, a] * rays[i, k, b]
    w, _, regular = solve3(mtm, ones)
    return state, w, regular and w[0] ** 2 + w[1] ** 2 + w[2] ** 2 > 1.0 + 1e-9


@jit
def consensus_cone(
    rays: FloatArray, strengths: FloatArray, normals: FloatArray, s0: FloatArray, seed: int
) -> tuple[FloatArray, float]:
    """The w (3,) on which most normals agree, and its score (at most the number of normals).

    Starts from the predicted s0 (3,); trials are triples of normals about a third of a turn
    apart, drawn by a fixed generator, so that equal images give equal results.
    """
    count = rays.shape[0]
    w_best = s0 / np.sqrt(s0[0] ** 2 + s0[1] ** 2 + s0[2] ** 2 - 1.0)
    score_best = _score(rays, strengths, normals, w_best, 0.0)
    state = np.uint64(seed * 2 + 1)
    for _ in range(_TRIALS):
        state, w, usable = _trial(rays, strengths, state)
        if not usable:
            continue
        score = _score(rays, strengths, normals, w, score_best)
        if score > score_best:
            score_best = score
            w_best = w
            if score > _ENOUGH * count:
                break
    return w_best, score_best


@jit
def nearest_peaks(
    rays: FloatArray, strengths: FloatArray, normals: FloatArray, w: FloatArray, gate_px: float
) -> tuple[FloatArray, FloatArray]:
    """Per normal the index (-1: none) and residual of the candidate nearest the cone of w."""
    q = np.sqrt(w[0] ** 2 + w[1] ** 2 + w[2] ** 2 - 1.0)
    count = rays.shape[0]
    chosen = np.full(count, -1.0)
    residuals = np.full(count, np.nan)
    for i in range(count):
        nearest = gate_px
        for k in range(MAX_PEAKS):
            if strengths[i, k] <= 0.0:
                break
            r = cone_residual(rays[i, k], normals[i, 4], w, q)
            if abs(r) < nearest:
                nearest = abs(r)
                chosen[i] = k
                residuals[i] = r
    return chosen, residuals


@jit
def robust_scale(residuals: FloatArray) -> float:
    """1.48 times the median size of the finite residuals, with a floor, in px."""
    sizes = np.abs(residuals[np.isfinite(residuals)])
    if sizes.shape[0] == 0:
        return _LEAST_SCALE_PX
    return max(_LEAST_SCALE_PX, 1.4826 * float(np.median(sizes)))


@jit
def fit_cone(
    rays: FloatArray, strengths: FloatArray, normals: FloatArray, w0: FloatArray, gate_px: float
) -> tuple[FloatArray, FloatArray, FloatArray, float, bool]:
    """Robust least squares from w0: w (3,), inverse normal matrix, residuals, scale, success.

    Residuals and their scale are in px, so the covariance of w is scale^2 times the inverse.
    Residuals are NaN for normals without an edge within the gate.
    """
    w = w0.copy()
    count = rays.shape[0]
    scale = gate_px / _TUKEY
    inverse = np.zeros((3, 3))
    residuals = np.full(count, np.nan)
    gate = gate_px
    for step in range(_FIT_STEPS):
        chosen, residuals = nearest_peaks(rays, strengths, normals, w, gate)
        scale = robust_scale(residuals)
        gate = max(1.0, min(gate, 3.0 * _TUKEY * scale))
        q = np.sqrt(w[0] ** 2 + w[1] ** 2 + w[2] ** 2 - 1.0)
        m = np.zeros((3, 3))
        b = np.zeros(3)
        for i in range(count):
            r = residuals[i] / (_TUKEY * scale)
            if not abs(r) < 1.0:
                continue
            ray = rays[i, int(chosen[i])]
            weight = (1.0 - r * r) ** 2 * (normals[i, 4] / q) ** 2
            for a in range(3):
                b[a] += weight * ray[a]
                for c in range(3):
                    m[a, c] += weight * ray[a] * ray[c]
        w_new, inverse, regular = solve3(m, b)
        if not regular or not w_new[0] ** 2 + w_new[1] ** 2 + w_new[2] ** 2 > 1.0 + 1e-9:
            return np.zeros(3), np.zeros((3, 3)), residuals, scale, False
        moved = np.sqrt(np.sum((w_new - w) ** 2))
        w = w_new
        if step > 1 and moved < 1e-9:
            break
    _, residuals = nearest_peaks(rays, strengths, normals, w, gate_px)
    return w, inverse, residuals, scale, True


@jit
def s_of_cone(w: FloatArray, covariance_w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """s (3,) and its covariance (3, 3) from w = s / sqrt(|s|^2 - 1)."""
    q = np.sqrt(w[0] ** 2 + w[1] ** 2 + w[2] ** 2 - 1.0)
    return w / q, spread_through(w, 1.0 / q, -1.0 / q**3, covariance_w)
