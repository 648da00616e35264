"""Where each collected pixel lies with respect to an outline (compiled, several at a time)."""

import numpy as np

from estimator.image.intrinsics import FloatArray
from estimator.image.limb_pixels import (
    BEND,
    DISTANCE,
    GEOMETRY,
    J0,
    J1,
    J2,
    J3,
    NU,
    NV,
    X,
    Y,
)
from estimator.jit import jit_sums


@jit_sums
def locate(pixels: FloatArray, s: FloatArray, a: FloatArray, frame: FloatArray) -> None:
    """Fill the columns from DISTANCE on: `cone.distance` and `cone.derivatives` of (s, a).

    The latter are those of the distance in px at the pixel's foot point, by |s| and by rotations
    about the rows of ``frame``.
    """
    s0, s1, s2, a0, a1, a2 = s[0], s[1], s[2], a[0], a[1], a[2]
    k2 = s0 * s0 + s1 * s1 + s2 * s2 - 1.0
    k, rate = np.sqrt(k2), np.sqrt((k2 + 1.0) / k2)
    b00, b01, b02 = frame[0, 0], frame[0, 1], frame[0, 2]
    b10, b11, b12 = frame[1, 0], frame[1, 1], frame[1, 2]
    b20, b21, b22 = frame[2, 0], frame[2, 1], frame[2, 2]
    for i in range(pixels.shape[1]):
        x, y = pixels[X, i], pixels[Y, i]
        xu, xv, yu, yv = pixels[J0, i], pixels[J1, i], pixels[J2, i], pixels[J3, i]
        along = x * a0 + y * a1 + a2
        qx, qy, qz = x - along * a0, y - along * a1, 1.0 - along * a2
        q2 = qx * qx + qy * qy + qz * qz
        q = np.sqrt(q2)
        kq = k / q
        f = x * s0 + y * s1 + s2 - k * q
        fx, fy = s0 - kq * qx, s1 - kq * qy
        gu, gv = fx * xu + fy * yu, fx * xv + fy * yv
        g = np.sqrt(gu * gu + gv * gv) + 1e-300
        nu, nv = gu / g, gv / g
        # Second derivatives of F along the normal and the tangent.
        dx, dy = xu * nu + xv * nv, yu * nu + yv * nv
        da, dm = dx * a0 + dy * a1, dx * qx + dy * qy
        normal_bend = -kq * (dx * dx + dy * dy - da * da - dm * dm / q2)
        tx, ty = xv * nu - xu * nv, yv * nu - yu * nv
        ta, tm = tx * a0 + ty * a1, tx * qx + ty * qy
        tangent_bend = -kq * (tx * tx + ty * ty - ta * ta - tm * tm / q2)
        steep = np.sqrt(max(g * g - 2.0 * normal_bend * f, 1e-4 * g * g))
        d = 2.0 * f / (g + steep)
        per = 1.0 / steep
        pixels[DISTANCE, i], pixels[NU, i], pixels[NV, i] = d, nu, nv
        pixels[BEND, i] = -tangent_bend * per
        # The foot point and the gradient there.
        x, y = x - d * dx, y - d * dy
        along = x * a0 + y * a1 + a2
        qx, qy, qz = x - along * a0, y - along * a1, 1.0 - along * a2
        q = np.sqrt(qx * qx + qy * qy + qz * qz)
        kq = k / q
        fx, fy, fz = s0 - kq * qx, s1 - kq * qy, s2 - kq * qz
        cx, cy, cz = (fy - fz * y) * per, (fz * x - fx) * per, (fx * y - fy * x) * per
        pixels[GEOMETRY, i] = (x * b20 + y * b21 + b22 - rate * q) * per
        pixels[GEOMETRY + 1, i] = cx * b00 + cy * b01 + cz * b02
        pixels[GEOMETRY + 2, i] = cx * b10 + cy * b11 + cz * b12
        pixels[GEOMETRY + 3, i] = cx * b20 + cy * b21 + cz * b22
