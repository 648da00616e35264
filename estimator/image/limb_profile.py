"""The blurred edge across an outline, in closed form.

A pixel sees the scene through a kernel. Along the edge's normal n that kernel is the product of
three boxes: the pixel's own two sides (widths |n_u|, |n_v|) and the motion during the exposure.
A step through three boxes is a sum of eight truncated cubics, a linear or square-root rise behind
the step one of other powers. The lens' point spread is a Gaussian, through which the cubics are
smooth; where it is narrow, and for the rises, the pixel's boxes widened so that the variance is
right do as well. There is no branch anywhere, so that the compiler works on several pixels at once.
"""

import math

import numpy as np

from estimator.jit import jit_inlined

# A narrower box than this cannot be told from none (variance 2e-4 px^2) but divides by little.
LEAST_WIDTH_PX = 0.05


@jit_inlined
def _cubic(x: float) -> tuple[float, float, float]:
    """The first three powers of max(x, 0)."""
    t = max(x, 0.0)
    return t, t * t, t * t * t


@jit_inlined
def _powers(x: float) -> tuple[float, float, float]:
    """The powers 2.5, 3.5 and 4 of max(x, 0)."""
    t = max(x, 0.0)
    t2 = t * t
    half = t2 * np.sqrt(t)
    return half, half * t, t2 * t2


@jit_inlined
def _cubic_corners(d: float, a: float, b: float) -> tuple[float, float, float]:
    """`_cubic` through the boxes a and b, times their widths: differences at their corners."""
    p, q = 0.5 * (a + b), 0.5 * (a - b)
    h1, h2, h3 = _cubic(d + p)
    i1, i2, i3 = _cubic(d + q)
    j1, j2, j3 = _cubic(d - q)
    k1, k2, k3 = _cubic(d - p)
    return h1 - i1 - j1 + k1, h2 - i2 - j2 + k2, h3 - i3 - j3 + k3


@jit_inlined
def _power_corners(d: float, a: float, b: float) -> tuple[float, float, float]:
    """`_powers` through the boxes a and b, as `_cubic_corners`."""
    p, q = 0.5 * (a + b), 0.5 * (a - b)
    h1, h2, h3 = _powers(d + p)
    i1, i2, i3 = _powers(d + q)
    j1, j2, j3 = _powers(d - q)
    k1, k2, k3 = _powers(d - p)
    return h1 - i1 - j1 + k1, h2 - i2 - j2 + k2, h3 - i3 - j3 + k3


@jit_inlined
def edge_step(d: float, a: float, b: float, w: float) -> tuple[float, float, float, float]:
    """A step at distance ``d`` inside the outline through boxes a, b, w (all in px).

    Returns C, the share seen of the inner side; dC/dd; dC/d(w^2); dC/d(variance) as half the
    second derivative.
    """
    p1, p2, p3 = _cubic_corners(d + 0.5 * w, a, b)
    m1, m2, m3 = _cubic_corners(d - 0.5 * w, a, b)
    scale = 1.0 / (a * b * w)
    share = (p3 - m3) * scale / 6.0
    ends = 0.25 * (p2 + m2) / (a * b)
    return share, 0.5 * (p2 - m2) * scale, (ends - share) / (2.0 * w * w), 0.5 * (p1 - m1) * scale


@jit_inlined
def _normal(z: float) -> tuple[float, float]:
    """Density of the standard normal distribution at ``z``, and its integral up to there.

    The integral to 1e-7, after Abramowitz and Stegun, Handbook of Mathematical Functions, 7.1.26.
    """
    x = max(-0.5 * z * z, -40.0) / 1024.0
    e = 1.0 + x * (1.0 + x * (0.5 + x / 6.0))
    for _ in range(10):
        e *= e
    t = 1.0 / (1.0 + 0.3275911 / math.sqrt(2.0) * abs(z))
    c = t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))
    beyond = 0.5 * t * (0.254829592 + c) * e
    return e / math.sqrt(2.0 * math.pi), 1.0 - beyond if z > 0.0 else beyond


@jit_inlined
def _smooth_cubic(x: float, sigma: float) -> tuple[float, float, float]:
    """`_cubic` through a Gaussian of ``sigma``."""
    density, below = _normal(x / sigma)
    density *= sigma
    x2, v = x * x, sigma * sigma
    return (
        x * below + density,
        (x2 + v) * below + x * density,
        (x2 + 3.0 * v) * x * below + (x2 + 2.0 * v) * density,
    )


@jit_inlined
def _smooth_corners(d: float, a: float, b: float, sigma: float) -> tuple[float, float, float]:
    """`_smooth_cubic` through the boxes a and b, as `_cubic_corners`."""
    p, q = 0.5 * (a + b), 0.5 * (a - b)
    h1, h2, h3 = _smooth_cubic(d + p, sigma)
    i1, i2, i3 = _smooth_cubic(d + q, sigma)
    j1, j2, j3 = _smooth_cubic(d - q, sigma)
    k1, k2, k3 = _smooth_cubic(d - p, sigma)
    return h1 - i1 - j1 + k1, h2 - i2 - j2 + k2, h3 - i3 - j3 + k3


@jit_inlined
def smooth_step(
    d: float, a: float, b: float, w: float, sigma: float
) -> tuple[float, float, float, float]:
    """`edge_step` through a Gaussian of ``sigma`` as well."""
    p1, p2, p3 = _smooth_corners(d + 0.5 * w, a, b, sigma)
    m1, m2, m3 = _smooth_corners(d - 0.5 * w, a, b, sigma)
    scale = 1.0 / (a * b * w)
    share = (p3 - m3) * scale / 6.0
    ends = 0.25 * (p2 + m2) / (a * b)
    return share, 0.5 * (p2 - m2) * scale, (ends - share) / (2.0 * w * w), 0.5 * (p1 - m1) * scale


@jit_inlined
def edge_rise(d: float, a: float, b: float, w: float) -> tuple[float, float, float]:
    """The blurred rise max(d, 0), and the blurred sqrt(max(d, 0)) and its derivative."""
    p25, p35, p4 = _power_corners(d + 0.5 * w, a, b)
    m25, m35, m4 = _power_corners(d - 0.5 * w, a, b)
    scale = 1.0 / (a * b * w)
    return (p4 - m4) * scale / 24.0, (p35 - m35) * scale / 13.125, (p25 - m25) * scale / 3.75
