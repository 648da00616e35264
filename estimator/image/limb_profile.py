"""The blurred edge across an outline, in closed form.

A pixel sees the scene through a kernel. Along the edge's normal n that kernel is the product of
three boxes: the pixel's own two sides (widths |n_u|, |n_v|) and the motion during the exposure.
The lens' point spread widens the pixel's two boxes so that the variance is right; once it is
convolved with the others its exact shape hardly matters. A step through three boxes is a sum of
eight truncated cubics, a linear or square-root rise behind the step one of other powers.
"""

import numpy as np

from estimator.image.intrinsics import FloatArray
from estimator.jit import jit

# A narrower box than this cannot be told from none (variance 2e-4 px^2) but divides by little.
LEAST_WIDTH_PX = 0.05


@jit
def edge_profile(d: float, a: float, b: float, w: float, out: FloatArray) -> None:
    """What a step at distance ``d`` inside the outline looks like through boxes a, b, w (px).

    Fills ``out`` (8,): C, the share seen of the inner side; dC/dd; dC/d(w^2); dC/d(variance) as
    half the second derivative; the blurred rise max(d, 0); the blurred sqrt(max(d, 0)) and its
    derivative; C of the mean of both ends of the motion.
    """
    reach = 0.5 * (a + b + w)
    if d <= -reach:
        out[:] = 0.0
        return
    if d >= reach:
        out[:] = 0.0
        variance = (a * a + b * b + w * w) / 12.0
        root = np.sqrt(d)
        out[0] = 1.0
        out[4] = d
        out[5] = root * (1.0 - variance / (8.0 * d * d))
        out[6] = 0.5 / root
        return
    c1 = c2_plus = c2_minus = c3 = c4 = h25 = h35 = 0.0
    for i in range(8):
        da = a if i & 1 else -a
        db = b if i & 2 else -b
        dw = w if i & 4 else -w
        x = d + 0.5 * (da + db + dw)
        if x <= 0.0:
            continue
        sign = 1.0 if ((i & 1) + ((i >> 1) & 1) + ((i >> 2) & 1)) & 1 else -1.0
        x2 = x * x
        c1 += sign * x
        if i & 4:
            c2_plus += sign * x2
        else:
            c2_minus -= sign * x2
        c3 += sign * x2 * x
        c4 += sign * x2 * x2
        r25 = sign * x2 * np.sqrt(x)
        h25 += r25
        h35 += r25 * x
    scale = 1.0 / (a * b * w)
    share = c3 * scale / 6.0
    ends = 0.25 * (c2_plus + c2_minus) / (a * b)
    out[0] = share
    out[1] = 0.5 * (c2_plus - c2_minus) * scale
    out[2] = (ends - share) / (2.0 * w * w)
    out[3] = 0.5 * c1 * scale
    out[4] = c4 * scale / 24.0
    out[5] = h35 * scale / 13.125
    out[6] = h25 * scale / 3.75
    out[7] = ends
