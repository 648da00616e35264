"""The cone of rays that touch a unit sphere or cylinder around s, and its outline in the image.

One function describes both: F(p) = p.s - sqrt(|s|^2 - 1) |Q p| is positive for the rays p that
meet the target, with Q = I for the sphere and Q = I - a a^T for the cylinder (a = 0 therefore
means a sphere). From F = 0 follow the sphere's cone (p.s)^2 = (|s|^2 - 1)|p|^2 and the cylinder's
two tangent planes (eq. 13 ff.).
"""

import numpy as np

from estimator.image.intrinsics import FloatArray
from estimator.jit import jit


@jit
def outline_frame(s: FloatArray, a: FloatArray) -> FloatArray:
    """Rows b1, b2, e: unit vectors with e along s; for the cylinder b1 is the axis."""
    e = s / np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
    b1 = a.copy()
    if a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0:
        # Any direction normal to e: start from the coordinate axis farthest from it.
        if abs(e[0]) < 0.8:
            b1[0] = 1.0
        else:
            b1[1] = 1.0
    b1 = b1 - e * (b1[0] * e[0] + b1[1] * e[1] + b1[2] * e[2])
    b1 = b1 / np.sqrt(b1[0] ** 2 + b1[1] ** 2 + b1[2] ** 2)
    frame = np.empty((3, 3))
    frame[0] = b1
    frame[1, 0] = e[1] * b1[2] - e[2] * b1[1]
    frame[1, 1] = e[2] * b1[0] - e[0] * b1[2]
    frame[1, 2] = e[0] * b1[1] - e[1] * b1[0]
    frame[2] = e
    return frame


@jit
def side(x: float, y: float, s: FloatArray, a: FloatArray) -> tuple[float, float, float, float]:
    """F at the ray (x, y, 1) and its gradient (3,) with respect to the ray."""
    k = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2 - 1.0)
    along = x * a[0] + y * a[1] + a[2]
    qx, qy, qz = x - along * a[0], y - along * a[1], 1.0 - along * a[2]
    q = np.sqrt(qx * qx + qy * qy + qz * qz)
    value = x * s[0] + y * s[1] + s[2] - k * q
    return value, s[0] - k * qx / q, s[1] - k * qy / q, s[2] - k * qz / q


@jit
def distance(
    x: float, y: float, xu: float, xv: float, yu: float, yv: float, s: FloatArray, a: FloatArray
) -> tuple[float, float, float, float, float]:
    """Signed distance to the outline in pixels, positive inside, and what goes with it.

    (x, y) is the pixel's normalised position, xu ... yv its derivatives dx/du, dx/dv, dy/du, dy/dv.
    Returns (distance, unit inward normal u, v, outline's curvature in 1/px, |grad F| per pixel at
    the foot point). F is quadratic in the image to the fourth order of the angle, so that the
    nearest root of its second-order expansion along the gradient is the distance.
    """
    f, fx, fy, _ = side(x, y, s, a)
    gu, gv = fx * xu + fy * yu, fx * xv + fy * yv
    g = np.sqrt(gu * gu + gv * gv) + 1e-300
    nu, nv = gu / g, gv / g
    normal_bend = _second(x, y, xu * nu + xv * nv, yu * nu + yv * nv, s, a)
    tangent_bend = _second(x, y, xv * nu - xu * nv, yv * nu - yu * nv, s, a)
    foot_g = np.sqrt(max(g * g - 2.0 * normal_bend * f, 1e-4 * g * g))
    return 2.0 * f / (g + foot_g), nu, nv, -tangent_bend / foot_g, foot_g


@jit
def _second(x: float, y: float, dx: float, dy: float, s: FloatArray, a: FloatArray) -> float:
    """Second derivative of F at (x, y, 1) along (dx, dy, 0)."""
    k = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2 - 1.0)
    along = x * a[0] + y * a[1] + a[2]
    qx, qy, qz = x - along * a[0], y - along * a[1], 1.0 - along * a[2]
    q2 = qx * qx + qy * qy + qz * qz
    d_along = dx * a[0] + dy * a[1]
    square = dx * dx + dy * dy - d_along * d_along
    # Q is a projection: (Q d).(Q p) = d.(Q p).
    mixed = dx * qx + dy * qy
    return float(-k * (square - mixed * mixed / q2) / np.sqrt(q2))


@jit
def derivatives(
    x: float, y: float, s: FloatArray, a: FloatArray, frame: FloatArray, count: int, out: FloatArray
) -> None:  # fmt: skip
    """Derivatives of F at the ray (x, y, 1) into ``out``: by |s|, then by rotations about frame.

    Turning the target by w turns the rays by -w, hence dF/dw = grad F x p; the third rotation,
    about s itself, only matters for the cylinder (``count`` is 3 or 4).
    """
    _, gx, gy, gz = side(x, y, s, a)
    k2 = s[0] ** 2 + s[1] ** 2 + s[2] ** 2 - 1.0
    along = x * a[0] + y * a[1] + a[2]
    q = np.sqrt(x * x + y * y + 1.0 - along * along)
    toward = x * frame[2, 0] + y * frame[2, 1] + frame[2, 2]
    out[0] = toward - np.sqrt((k2 + 1.0) / k2) * q
    tx, ty, tz = gy - gz * y, gz * x - gx, gx * y - gy * x
    for i in range(count - 1):
        out[i + 1] = tx * frame[i, 0] + ty * frame[i, 1] + tz * frame[i, 2]


@jit
def moved(
    s: FloatArray, a: FloatArray, frame: FloatArray, step: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """s and a after a ``step`` of the parameters of `derivatives`; a stays unit and normal to s."""
    w = step[1] * frame[0] + step[2] * frame[1]
    if step.shape[0] > 3:
        w = w + step[3] * frame[2]
    length = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
    return _rotated(s * (1.0 + step[0] / length), w), _rotated(a, w)


@jit
def _rotated(p: FloatArray, w: FloatArray) -> FloatArray:
    """p (3,) turned by the rotation vector w (3,)."""
    angle = np.sqrt(w[0] ** 2 + w[1] ** 2 + w[2] ** 2)
    if angle < 1e-12:
        return p.copy()
    u = w / angle
    c, sn = np.cos(angle), np.sin(angle)
    up = (u[0] * p[0] + u[1] * p[1] + u[2] * p[2]) * (1.0 - c)
    out = np.empty(3)
    out[0] = p[0] * c + (u[1] * p[2] - u[2] * p[1]) * sn + u[0] * up
    out[1] = p[1] * c + (u[2] * p[0] - u[0] * p[2]) * sn + u[1] * up
    out[2] = p[2] * c + (u[0] * p[1] - u[1] * p[0]) * sn + u[2] * up
    return out
