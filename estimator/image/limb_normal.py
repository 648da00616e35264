"""Normal equations of the outline's likelihood, one sector at a time (compiled).

A pixel's grey is linear in its sector's photometry p (PHOTOMETRY,): background level, its change
along and across the outline; foreground level, its change along, across, and a square-root rise
(a shaded round body brightens like the root of the depth behind its limb). The shared parameters
are the geometry (cone.derivatives) and the blur: q = 6 sigma^2 of the point spread, and the squared
width of the motion along the normal n, w^2 = M1 n1^2 + h1 n1 + 2 M12 n1 n2 + M2 n2^2 + h2 n2, as
(q, M1, h1, M12, M2, h2) in image axes turned by an angle. A cylinder's lines are straight and share
one normal, but its depth, and with it the motion, changes along them: n2 there means n1 times the
place along the line, -1 to 1. Each sector's photometry is eliminated on the spot (Schur).
"""

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import FloatArray
from estimator.image.limb_edge import (
    ALL_ROWS,
    BLUR,
    MODEL_ROWS,
    MOST_PIXELS,
    PHOTOMETRY,
    R_BLUR,
    R_GEOMETRY,
    R_GREY,
    R_RESIDUAL,
    WEIGHT,
    WEIGHTED,
    edge_rows,
)
from estimator.image.limb_linear import inverse_diagonal, reduce_normal
from estimator.image.limb_parts import parted, reach_px
from estimator.jit import jit_sums

# Columns of the sector statistics.
N_OUT, SS_OUT, N_IN, SS_IN, N_EDGE, CHI_EDGE, SHIFT, SHIFT_INFO, STATS = 0, 1, 2, 3, 4, 5, 6, 7, 8
_VECTOR = 8


@jit_sums
def accumulate(
    pixels: FloatArray, starts: NDArray[np.int64], moved_by: FloatArray, blur: FloatArray,
    turn_rad: float, photometry: FloatArray, noise: FloatArray, ridge: FloatArray,
    mean: FloatArray, predicted: bool, heavy_tail: float, margin_px: float, smooth: bool,
    information: FloatArray, score: FloatArray, back: FloatArray, spread: FloatArray,
    stats: FloatArray, work: FloatArray,
) -> None:  # fmt: skip
    """Fill each sector's reduced information, score, photometry back-substitution and statistics.

    ``moved_by`` (geometry,) is how far the geometry is from that at which the pixels were located,
    ``margin_px`` bounds the outline's error; ``smooth``: see `reach_px`. ``noise`` (sectors, 2):
    variances of reading and of the background. ``ridge`` (PHOTOMETRY,) and ``mean`` (sectors,
    PHOTOMETRY): the inverse prior variance of p about its mean. ``predicted``: what is under the
    edge is `predict_clutter`'s, its level that of ``mean``, and the pixels outside tell no more
    about it. ``information``
    (sectors, n, n), ``score`` (sectors, n) with n geometry and blur parameters; ``back``
    (sectors, PHOTOMETRY, n + 1):
    p = back[:, n] - back[:, :n] @ step;
    ``spread`` (sectors, PHOTOMETRY): variances of p. ``heavy_tail``: the degrees of freedom of the
    residuals, 0 when p is unknown. ``work`` (3, ALL_ROWS * MOST_PIXELS) holds no NaN.
    """
    n = score.shape[1]
    geometry = n - BLUR
    width = n + 1  # the last column is a plain shift of the outline, for the sector's own verdict
    rows, outside, inside = work[0], work[1], work[2]
    gram = np.empty((MODEL_ROWS, MODEL_ROWS))
    at = np.empty(width, dtype=np.int64)  # the rows of the shared parameters
    for j in range(width):
        at[j] = R_GEOMETRY + j if j < geometry else R_BLUR + j - geometry
    gpp = np.empty((PHOTOMETRY, PHOTOMETRY))
    rhs = np.empty((PHOTOMETRY, width + 1))
    gtt = np.empty((width, width + 1))
    fit = np.empty((PHOTOMETRY, width + 1))
    turn = np.array([np.cos(turn_rad), np.sin(turn_rad)])
    along, level = np.empty(2), np.empty(2)
    reach = reach_px(blur, margin_px, smooth)
    stats[:] = 0.0
    per_line = (starts.shape[0] - 1) // 2
    along[1] = 2.0 / max(per_line, 1)
    for k in range(starts.shape[0] - 1):
        p, noise_k, stats_k = photometry[k], noise[k], stats[k]
        # A fitted level would follow the clutter that the prediction missed, and give the sectors
        # that look dark under the edge more weight: their outlines are off to one side.
        level[0], level[1] = (mean[k, 0], 0.0) if predicted else (p[0], p[1])
        along[0] = (k % max(per_line, 1) + 0.5) * along[1] - 1.0
        n_edge, n_out, n_in = parted(
            pixels, starts[k], starts[k + 1], moved_by, reach, rows, outside, inside
        )
        if smooth:
            sigma = np.sqrt(blur[0] / 6.0)
            stats_k[N_EDGE], stats_k[CHI_EDGE] = edge_rows(
                rows, n_edge, along, blur, turn, p, level, noise_k, heavy_tail, geometry, sigma
            )
        else:
            stats_k[N_EDGE], stats_k[CHI_EDGE] = edge_rows(
                rows, n_edge, along, blur, turn, p, level, noise_k, heavy_tail, geometry, None
            )
        _gram(rows, n_edge, MODEL_ROWS, gram)
        for i in range(PHOTOMETRY):
            for j in range(i + 1):
                gpp[i, j] = gram[i, j]
            gpp[i, i] += ridge[i]
            for j in range(width):
                rhs[i, j] = gram[at[j], i]
            rhs[i, width] = gram[R_GREY, i] + ridge[i] * mean[k, i]
        for j in range(width):
            for i in range(j + 1):
                gtt[j, i] = gram[at[j], at[i]]
            gtt[j, width] = gram[R_RESIDUAL, at[j]]
        stats_k[N_OUT], stats_k[N_IN] = float(n_out), float(n_in)
        if not predicted:
            variance = noise_k[0] + noise_k[1]
            stats_k[SS_OUT] = _weights(outside, n_out, p[:3], variance, heavy_tail)
            _gram(outside, n_out, 4, gram)
            _add_side(gram, 0, 3, gpp, rhs)
        stats_k[SS_IN] = _weights(inside, n_in, p[3:], noise_k[0], heavy_tail)
        _gram(inside, n_in, 5, gram)
        _add_side(gram, 3, 4, gpp, rhs)
        reduce_normal(gpp, rhs, gtt, p, fit)
        inverse_diagonal(gpp, spread[k])
        _store(gtt, fit, information[k], score[k], back[k], stats_k)


@jit_sums
def _weights(
    rows: FloatArray, count: int, p: FloatArray, variance: float, heavy_tail: float
) -> float:
    """Inverse variances, reduced where the residual is far out (Student's t); sum of squares."""
    terms = p.shape[0]
    total = 0.0
    for i in range(count):
        r = rows[terms * MOST_PIXELS + i]
        for j in range(terms):
            r -= p[j] * rows[j * MOST_PIXELS + i]
        total += r * r
        rows[WEIGHT * MOST_PIXELS + i] = (heavy_tail + 1.0) / (heavy_tail * variance + r * r)
    if heavy_tail <= 0.0:
        rows[WEIGHT * MOST_PIXELS : WEIGHT * MOST_PIXELS + count] = 1.0 / variance
    return total


@jit_sums
def _gram(flat: FloatArray, count: int, used: int, out: FloatArray) -> None:
    """Weighted scalar products of the first ``used`` rows into the lower triangle of ``out``.

    Two rows by two at a time, which loads each number half as often.
    """
    rows = flat.reshape((ALL_ROWS, MOST_PIXELS))
    # Up to whole vectors of the processor, with pixels of no weight.
    padded = min((count + _VECTOR - 1) // _VECTOR * _VECTOR, MOST_PIXELS)
    for i in range(count, padded):
        rows[WEIGHT, i] = 0.0
    for half_j in range((used + 1) // 2):
        j = 2 * half_j
        for i in range(padded):
            weight = rows[WEIGHT, i]
            rows[WEIGHTED, i] = weight * rows[j, i]
            rows[WEIGHTED + 1, i] = weight * rows[j + 1, i]
        for half_m in range(half_j + 1):
            m = 2 * half_m
            t00 = t01 = t10 = t11 = 0.0
            for i in range(padded):
                one, other = rows[WEIGHTED, i], rows[WEIGHTED + 1, i]
                first, second = rows[m, i], rows[m + 1, i]
                t00 += one * first
                t01 += one * second
                t10 += other * first
                t11 += other * second
            out[j, m], out[j, m + 1], out[j + 1, m], out[j + 1, m + 1] = t00, t01, t10, t11


@jit_sums
def _add_side(gram: FloatArray, first: int, terms: int, gpp: FloatArray, rhs: FloatArray) -> None:
    """Add the products of one side's pixels to the photometry's equations."""
    for i in range(terms):
        for j in range(i + 1):
            gpp[first + i, first + j] += gram[i, j]
        rhs[first + i, rhs.shape[1] - 1] += gram[terms, i]


@jit_sums
def _store(
    gtt: FloatArray, fit: FloatArray, information: FloatArray, score: FloatArray,
    back: FloatArray, stats: FloatArray,
) -> None:  # fmt: skip
    """Copy one sector's reduced equations to where the solution expects them."""
    n = score.shape[0]
    for j in range(n):
        score[j] = gtt[j, n + 1]
        for i in range(j + 1):
            information[j, i] = information[i, j] = gtt[j, i]
    for m in range(PHOTOMETRY):
        for j in range(n):
            back[m, j] = fit[m, j]
        back[m, n] = fit[m, n + 1]
    stats[SHIFT_INFO] = max(float(gtt[n, n]), 0.0)
    stats[SHIFT] = gtt[n, n + 1] / gtt[n, n] if gtt[n, n] > 1e-12 else 0.0
