"""The model of the pixels across the outline, and its derivatives (compiled, several at a time)."""

import numpy as np

from estimator.image.intrinsics import FloatArray
from estimator.image.limb_profile import LEAST_WIDTH_PX, edge_rise, edge_step, smooth_step
from estimator.jit import jit_sums

PHOTOMETRY = 7
BLUR = 6
# All rows lie in one flat array, MOST_PIXELS apart: with constant distances the compiler sees that
# they are apart, and works on several pixels at once. (Not 512 apart: rows 4096 bytes apart push
# each other out of the processor's cache.) First what the model makes of each pixel: the
# photometry's basis, derivatives by geometry (up to 4), blur and a plain shift, grey, residual.
MOST_PIXELS = 352  # across the outline in one sector
R_GEOMETRY, R_BLUR, R_SHIFT, R_GREY, R_RESIDUAL, MODEL_ROWS = 7, 11, 17, 18, 19, 20
# Then its weight, space for weighting two rows, and what the model is told.
WEIGHT, WEIGHTED, E_TAU, E_D, E_NU, E_NV, E_BEND, E_GEOMETRY = 20, 21, *range(23, 29)
E_CLUTTER, E_CLUTTER_VARIANCE, E_SHADE, E_SHADE_SLOPE, ALL_ROWS = 32, 33, 34, 35, 36
# Motion narrower than this is differentiated as if it were this wide: nearer to zero the
# derivative is a spike between the pixels.
_SMOOTH_WIDTH_PX = 0.7
_SEEN = 1e-9  # of the edge by a pixel, as a share


@jit_sums
def edge_rows(
    rows: FloatArray, count: int, along: FloatArray, blur: FloatArray, turn: FloatArray,
    p: FloatArray, level: FloatArray, noise: FloatArray, heavy_tail: float, geometry: int,
    sigma: float | None,
) -> tuple[float, float]:  # fmt: skip
    """Fill what the normal equations of ``count`` pixels are made of into ``rows``.

    ``along`` (2,) is the sector's place on a cylinder's line and its length, -1 to 1; ``level``
    (2,) the background's level and change along that the contrast is reckoned from. ``sigma`` of
    the point spread, or None for one so narrow that wider boxes will do: two kernels, each without
    the other's work. Returns how many pixels see the edge and their squared residuals over the
    expected variance.
    """
    q, m1, h1, m12, m2, h2 = blur[0], blur[1], blur[2], blur[3], blur[4], blur[5]
    cos, sin = turn[0], turn[1]
    p0, p1, p2, p3, p4, p5, p6 = p[0], p[1], p[2], p[3], p[4], p[5], p[6]
    q0, q1 = level[0], level[1]
    read, texture = noise[0], noise[1]
    place, length = along[0], along[1]
    sphere = geometry == 3
    freedom = max(heavy_tail, 1.0)
    robust = 1.0 if heavy_tail > 0.0 else 0.0
    seen_count = chi2 = 0.0
    for i in range(count):
        tau, grey, d = (
            rows[E_TAU * MOST_PIXELS + i],
            rows[R_GREY * MOST_PIXELS + i],
            rows[E_D * MOST_PIXELS + i],
        )
        clutter = rows[E_CLUTTER * MOST_PIXELS + i]
        clutter_variance = rows[E_CLUTTER_VARIANCE * MOST_PIXELS + i]
        shade_slope = rows[E_SHADE_SLOPE * MOST_PIXELS + i]
        shade = rows[E_SHADE * MOST_PIXELS + i] + shade_slope * d
        nu, nv, bend = (
            rows[E_NU * MOST_PIXELS + i],
            rows[E_NV * MOST_PIXELS + i],
            rows[E_BEND * MOST_PIXELS + i],
        )
        n1 = cos * nu + sin * nv
        n2 = cos * nv - sin * nu if sphere else n1 * (place + tau * length)
        w2 = (m1 * n1 + 2.0 * m12 * n2 + h1) * n1 + (m2 * n2 + h2) * n2
        across2 = m1 * n2 * n2 - 2.0 * m12 * n1 * n2 + m2 * n1 * n1
        # A bent edge covers less of a kernel that is wide along it.
        d -= bend * (1.0 + 2.0 * q + max(across2, 0.0)) / 24.0
        bw = np.sqrt(max(w2, LEAST_WIDTH_PX**2))
        ba = np.sqrt(max(nu * nu + q, LEAST_WIDTH_PX**2))
        bb = np.sqrt(max(nv * nv + q, LEAST_WIDTH_PX**2))
        if sigma is None:
            share, c1, _, _ = edge_step(d, ba, bb, bw)
            _, _, c_w2, c_var = edge_step(d, ba, bb, max(bw, _SMOOTH_WIDTH_PX))
        else:
            pa, pb = max(abs(nu), LEAST_WIDTH_PX), max(abs(nv), LEAST_WIDTH_PX)
            share, c1, _, _ = smooth_step(d, pa, pb, bw, sigma)
            _, _, c_w2, c_var = smooth_step(d, pa, pb, max(bw, _SMOOTH_WIDTH_PX), sigma)
        rise, root, root_1 = edge_rise(d, ba, bb, bw)
        out = 1.0 - share
        grey -= out * clutter + shade
        rows[R_GREY * MOST_PIXELS + i] = grey
        rows[i], rows[MOST_PIXELS + i] = out, out * tau
        rows[2 * MOST_PIXELS + i] = d - rise
        rows[3 * MOST_PIXELS + i], rows[4 * MOST_PIXELS + i] = share, share * tau
        rows[5 * MOST_PIXELS + i], rows[6 * MOST_PIXELS + i] = rise, root
        model = out * (p0 + p1 * tau) + p2 * (d - rise)
        r = grey - model - share * (p3 + p4 * tau) - p5 * rise - p6 * root
        variance = read + out * out * (texture + clutter_variance)
        tail = (freedom + 1.0) / (freedom * variance + r * r)
        rows[WEIGHT * MOST_PIXELS + i] = robust * tail + (1.0 - robust) / variance
        seen = 1.0 if share > _SEEN and share < 1.0 - _SEEN else 0.0
        seen_count += seen
        chi2 += seen * r * r / variance
        contrast = p3 + p4 * tau - q0 - q1 * tau - clutter
        by_d = seen * (contrast * c1 + p2 + (p5 - p2) * share + p6 * root_1 + shade_slope)
        by_bend = by_d * bend / 24.0
        by_w2 = seen * (contrast * c_w2 + (p5 - p2) * c1 / 24.0)
        by_var = seen * (contrast * c_var + 0.5 * (p5 - p2) * c1)
        rows[R_GEOMETRY * MOST_PIXELS + i] = by_d * rows[E_GEOMETRY * MOST_PIXELS + i]
        rows[(R_GEOMETRY + 1) * MOST_PIXELS + i] = by_d * rows[(E_GEOMETRY + 1) * MOST_PIXELS + i]
        rows[(R_GEOMETRY + 2) * MOST_PIXELS + i] = by_d * rows[(E_GEOMETRY + 2) * MOST_PIXELS + i]
        rows[(R_GEOMETRY + 3) * MOST_PIXELS + i] = by_d * rows[(E_GEOMETRY + 3) * MOST_PIXELS + i]
        rows[R_BLUR * MOST_PIXELS + i] = by_var / 6.0 - 2.0 * by_bend
        rows[(R_BLUR + 1) * MOST_PIXELS + i] = by_w2 * n1 * n1 - by_bend * n2 * n2
        rows[(R_BLUR + 2) * MOST_PIXELS + i] = by_w2 * n1
        rows[(R_BLUR + 3) * MOST_PIXELS + i] = 2.0 * (by_w2 + by_bend) * n1 * n2
        rows[(R_BLUR + 4) * MOST_PIXELS + i] = by_w2 * n2 * n2 - by_bend * n1 * n1
        rows[(R_BLUR + 5) * MOST_PIXELS + i] = by_w2 * n2
        rows[R_SHIFT * MOST_PIXELS + i] = by_d
        rows[R_RESIDUAL * MOST_PIXELS + i] = r
    return seen_count, chi2
