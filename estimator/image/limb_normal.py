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

from estimator.image.cone import derivatives, distance
from estimator.image.intrinsics import FloatArray
from estimator.image.limb_linear import inverse_diagonal, reduce_normal
from estimator.image.limb_pixels import DISTANCE, GREY, J0, J1, J2, J3, TAU, X, Y
from estimator.image.limb_profile import LEAST_WIDTH_PX, edge_profile
from estimator.jit import jit

PHOTOMETRY = 7
BLUR = 6
# Motion narrower than this is differentiated as if it were this wide: nearer to zero the
# derivative is a spike between the pixels.
_SMOOTH_WIDTH_PX = 0.7
# Columns of the sector statistics.
N_OUT, SS_OUT, N_IN, SS_IN, N_EDGE, CHI_EDGE, SHIFT, SHIFT_INFO, STATS = 0, 1, 2, 3, 4, 5, 6, 7, 8


@jit
def accumulate(
    pixels: FloatArray, starts: NDArray[np.int64], stride: int, s: FloatArray, a: FloatArray,
    frame: FloatArray, blur: FloatArray, turn_rad: float, photometry: FloatArray,
    noise: FloatArray, ridge: FloatArray, heavy_tail: float, geometry: int, margin_px: float,
    information: FloatArray, score: FloatArray, back: FloatArray, spread: FloatArray,
    stats: FloatArray,
) -> None:  # fmt: skip
    """Fill each sector's reduced information, score, photometry back-substitution and statistics.

    Only every ``stride``-th pixel is used; ``margin_px`` bounds the error of the DISTANCE column.
    ``noise`` (sectors, 2): variances of reading and of the background. ``information`` (sectors,
    n, n), ``score`` (sectors, n) with n geometry and blur parameters; ``back`` (sectors,
    PHOTOMETRY, n + 1): p = back[:, n] - back[:, :n] @ step; ``spread`` (sectors, PHOTOMETRY):
    variances of p. Without ``heavy_tail`` (the degrees of freedom of the residuals) only the
    photometry is found.
    """
    n = score.shape[1]
    width = n + 1  # the last column is a plain shift of the outline, for the sector's own verdict
    basis = np.empty(PHOTOMETRY)
    column = np.zeros(geometry + BLUR + 1)
    profile = np.empty(8)
    gpp = np.empty((PHOTOMETRY, PHOTOMETRY))
    rhs = np.empty((PHOTOMETRY, width + 1))
    gtt = np.empty((width, width + 1))
    fit = np.empty((PHOTOMETRY, width + 1))
    turn = np.array([np.cos(turn_rad), np.sin(turn_rad)])
    reach = (
        margin_px
        + 0.5 * np.sqrt(blur[0] * 2.0 + 1.0)
        + 0.5 * np.sqrt(max(blur[1] + abs(blur[2]) + blur[4] + abs(blur[5]), 0.0))
    )
    stats[:] = 0.0
    along_step = 4.0 / (starts.shape[0] - 1)
    for k in range(starts.shape[0] - 1):
        p, noise_k, stats_k = photometry[k], noise[k], stats[k]
        along = (k % ((starts.shape[0] - 1) // 2) + 0.5) * along_step - 1.0
        gpp[:] = 0.0
        rhs[:] = 0.0
        gtt[:] = 0.0
        for i in range(PHOTOMETRY):
            gpp[i, i] = ridge[i]
        for i in range(starts[k], starts[k + 1], stride):
            tau, grey, d0 = pixels[i, TAU], pixels[i, GREY], pixels[i, DISTANCE]
            if d0 < -reach:
                r = grey - p[0] - p[1] * tau - p[2] * d0
                stats_k[N_OUT] += 1.0
                stats_k[SS_OUT] += r * r
                weight = _weight(r, noise_k[0] + noise_k[1], heavy_tail)
                wt, wd = weight * tau, weight * d0
                gpp[0, 0] += weight
                gpp[1, 0] += wt
                gpp[1, 1] += wt * tau
                gpp[2, 0] += wd
                gpp[2, 1] += wd * tau
                gpp[2, 2] += wd * d0
                rhs[0, width] += weight * grey
                rhs[1, width] += wt * grey
                rhs[2, width] += wd * grey
                continue
            if d0 > reach:
                basis[3], basis[4], basis[5], basis[6] = 1.0, tau, d0, np.sqrt(d0)
                r = grey - p[3] - p[4] * tau - p[5] * d0 - p[6] * basis[6]
                stats_k[N_IN] += 1.0
                stats_k[SS_IN] += r * r
                weight = _weight(r, noise_k[0], heavy_tail)
                for j in range(3, PHOTOMETRY):
                    wb = weight * basis[j]
                    for m in range(3, j + 1):
                        gpp[j, m] += wb * basis[m]
                    rhs[j, width] += wb * grey
                continue
            _edge_pixel(
                pixels, i, along, along_step, s, a, frame, blur, turn, p, noise_k, heavy_tail,
                geometry, basis, column, profile, gpp, rhs, gtt, stats_k,
            )  # fmt: skip
        reduce_normal(gpp, rhs, gtt, p, fit)
        inverse_diagonal(gpp, spread[k])
        _store(gtt, fit, information[k], score[k], back[k], stats_k)


@jit
def _weight(r: float, variance: float, heavy_tail: float) -> float:
    """Inverse variance, reduced where the residual is far out (Student's t)."""
    if heavy_tail <= 0.0:
        return 1.0 / variance
    return (heavy_tail + 1.0) / (heavy_tail * variance + r * r)


@jit
def _edge_pixel(
    pixels: FloatArray, i: int, along: float, along_step: float, s: FloatArray,
    a: FloatArray, frame: FloatArray, blur: FloatArray,
    turn: FloatArray, p: FloatArray, noise: FloatArray, heavy_tail: float, geometry: int,
    basis: FloatArray, column: FloatArray, profile: FloatArray, gpp: FloatArray,
    rhs: FloatArray, gtt: FloatArray, stats: FloatArray,
) -> None:  # fmt: skip
    """Add one pixel whose kernel may reach the outline."""
    width = gtt.shape[0]
    x, y, tau, grey = pixels[i, X], pixels[i, Y], pixels[i, TAU], pixels[i, GREY]
    xu, xv, yu, yv = pixels[i, J0], pixels[i, J1], pixels[i, J2], pixels[i, J3]
    d, nu, nv, bend, steep = distance(x, y, xu, xv, yu, yv, s, a)
    n1 = turn[0] * nu + turn[1] * nv
    n2 = turn[0] * nv - turn[1] * nu if geometry == 3 else n1 * (along + tau * along_step)
    w2 = (blur[1] * n1 + 2.0 * blur[3] * n2 + blur[2]) * n1 + (blur[4] * n2 + blur[5]) * n2
    across2 = blur[1] * n2 * n2 - 2.0 * blur[3] * n1 * n2 + blur[4] * n1 * n1
    # A bent edge covers less of a kernel that is wide along it.
    d_seen = d - bend * (1.0 + 2.0 * blur[0] + max(across2, 0.0)) / 24.0
    bw = np.sqrt(max(w2, LEAST_WIDTH_PX**2))
    ba = max(np.sqrt(nu * nu + blur[0]), LEAST_WIDTH_PX)
    bb = max(np.sqrt(nv * nv + blur[0]), LEAST_WIDTH_PX)
    edge_profile(d_seen, ba, bb, bw, profile)
    share = profile[0]
    out = 1.0 - share
    basis[0], basis[1], basis[2] = out, out * tau, d_seen - profile[4]
    basis[3], basis[4], basis[5], basis[6] = share, share * tau, profile[4], profile[5]
    model = 0.0
    for j in range(PHOTOMETRY):
        model += p[j] * basis[j]
    r = grey - model
    variance = noise[0] + out * out * noise[1]
    weight = _weight(r, variance, heavy_tail)
    for j in range(PHOTOMETRY):
        wb = weight * basis[j]
        for m in range(j + 1):
            gpp[j, m] += wb * basis[m]
        rhs[j, width] += wb * grey
    if not 0.0 < share < 1.0 or heavy_tail <= 0.0:
        return
    stats[N_EDGE] += 1.0
    stats[CHI_EDGE] += r * r / variance
    contrast = p[3] + p[4] * tau - p[0] - p[1] * tau
    rise = p[5] - p[2]
    c1 = profile[1]
    by_d = contrast * c1 + p[2] + rise * share + p[6] * profile[6]
    by_bend = by_d * bend / 24.0
    if bw < _SMOOTH_WIDTH_PX:
        edge_profile(d_seen, ba, bb, _SMOOTH_WIDTH_PX, profile)
    by_w2 = contrast * profile[2] + rise * c1 / 24.0
    by_var = contrast * profile[3] + 0.5 * rise * c1
    foot_x = x - d * (xu * nu + xv * nv)
    foot_y = y - d * (yu * nu + yv * nv)
    derivatives(foot_x, foot_y, s, a, frame, geometry, column)
    for j in range(geometry):
        column[j] *= by_d / steep
    column[geometry] = by_var / 6.0 - 2.0 * by_bend
    column[geometry + 1] = by_w2 * n1 * n1 - by_bend * n2 * n2
    column[geometry + 2] = by_w2 * n1
    column[geometry + 3] = 2.0 * (by_w2 + by_bend) * n1 * n2
    column[geometry + 4] = by_w2 * n2 * n2 - by_bend * n1 * n1
    column[geometry + 5] = by_w2 * n2
    column[width - 1] = by_d
    for j in range(width):
        wc = weight * column[j]
        for m in range(PHOTOMETRY):
            rhs[m, j] += wc * basis[m]
        for m in range(j + 1):
            gtt[j, m] += wc * column[m]
        gtt[j, width] += wc * r


@jit
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
