"""Where a predicted outline lies in the image, and which way its normals point (compiled).

A row of normals is (u, v, nu, nv, kappa): a pixel on the outline, the unit normal away from the
target, and kappa, pixels along that normal per radian between a ray and the outline's cone
(sphere) or tangent plane (cylinder).
"""

import numpy as np

from estimator.image.edges_camera import normalised_of, pixel_of
from estimator.image.intrinsics import FloatArray
from estimator.jit import jit

_STEP = 1e-5  # radians, for central differences of the exact map
_COARSE = 64
_BISECTIONS = 12


@jit
def across(x: float, y: float, z: float) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors that complete the unit (x, y, z) to a right-handed frame."""
    e1 = np.empty(3)
    if abs(z) > 0.6:
        norm = np.sqrt(x * x + z * z)
        e1[0], e1[1], e1[2] = z / norm, 0.0, -x / norm
    else:
        norm = np.sqrt(x * x + y * y)
        e1[0], e1[1], e1[2] = -y / norm, x / norm, 0.0
    e2 = np.empty(3)
    e2[0] = y * e1[2] - z * e1[1]
    e2[1] = z * e1[0] - x * e1[2]
    e2[2] = x * e1[1] - y * e1[0]
    return e1, e2


@jit
def _cone_pixel(
    camera: FloatArray, h: FloatArray, e1: FloatArray, e2: FloatArray, theta: float, phi: float
) -> tuple[float, float]:
    c, q = np.cos(theta), np.sin(theta)
    a, b = q * np.cos(phi), q * np.sin(phi)
    z = max(c * h[2] + a * e1[2] + b * e2[2], 1e-3)
    x = (c * h[0] + a * e1[0] + b * e2[0]) / z
    y = (c * h[1] + a * e1[1] + b * e2[1]) / z
    return pixel_of(camera, x, y)


@jit
def sphere_normals(camera: FloatArray, s: FloatArray, count: int) -> FloatArray:
    """Normals (count, 5) of the sphere's outline, evenly spread in angle about s (3,)."""
    distance = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
    h = s / distance
    theta = np.arcsin(min(1.0, 1.0 / distance))
    e1, e2 = across(h[0], h[1], h[2])
    rows = np.empty((count, 5))
    for i in range(count):
        phi = 2.0 * np.pi * i / count
        u, v = _cone_pixel(camera, h, e1, e2, theta, phi)
        ua, va = _cone_pixel(camera, h, e1, e2, theta, phi - _STEP)
        ub, vb = _cone_pixel(camera, h, e1, e2, theta, phi + _STEP)
        ui, vi = _cone_pixel(camera, h, e1, e2, theta - _STEP, phi)
        uo, vo = _cone_pixel(camera, h, e1, e2, theta + _STEP, phi)
        nu, nv = vb - va, ua - ub
        norm = np.sqrt(nu * nu + nv * nv) + 1e-300
        kappa = (nu * (uo - ui) + nv * (vo - vi)) / (norm * 2.0 * _STEP)
        if kappa < 0.0:
            nu, nv, kappa = -nu, -nv, -kappa
        rows[i, 0], rows[i, 1] = u, v
        rows[i, 2], rows[i, 3], rows[i, 4] = nu / norm, nv / norm, kappa
    return rows


@jit
def _line_pixel(
    camera: FloatArray, b1: FloatArray, b2: FloatArray, n: FloatArray, t: float, outward: float
) -> tuple[float, float]:
    z = max(b1[2] - outward * n[2], 1e-3)
    x = (b1[0] + t * b2[0] - outward * n[0]) / z
    y = (b1[1] + t * b2[1] - outward * n[1]) / z
    return pixel_of(camera, x, y)


@jit
def _in_view(u: float, v: float, width: int, height: int) -> bool:
    return 0.0 <= u <= width - 1.0 and 0.0 <= v <= height - 1.0


@jit
def view_radius(camera: FloatArray, width: int, height: int) -> float:
    """The largest normalised distance of an image corner from the optical axis."""
    radius = 0.0
    for corner in range(4):
        u = (width - 1.0) * (corner % 2)
        v = (height - 1.0) * (corner // 2)
        x, y = normalised_of(camera, u, v)
        radius = max(radius, np.sqrt(x * x + y * y))
    return radius


@jit
def line_frame(n: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """The plane's point b1 at depth 1 nearest the optical axis, its image direction b2, |b1 xy|."""
    rho = np.sqrt(n[0] * n[0] + n[1] * n[1]) + 1e-300
    b1 = np.empty(3)
    b1[0], b1[1], b1[2] = -n[2] * n[0] / (rho * rho), -n[2] * n[1] / (rho * rho), 1.0
    b2 = np.empty(3)
    b2[0], b2[1], b2[2] = -n[1] / rho, n[0] / rho, 0.0
    return b1, b2, abs(n[2]) / rho


@jit
def _edge_of_view(
    camera: FloatArray, b1: FloatArray, b2: FloatArray, n: FloatArray, inside: float,
    outside: float, width: int, height: int,
) -> float:  # fmt: skip
    for _ in range(_BISECTIONS):
        middle = 0.5 * (inside + outside)
        u, v = _line_pixel(camera, b1, b2, n, middle, 0.0)
        if _in_view(u, v, width, height):
            inside = middle
        else:
            outside = middle
    return inside


@jit
def line_normals(
    camera: FloatArray, n: FloatArray, count: int, width: int, height: int
) -> FloatArray:
    """Normals (count, 5) of the visible part of the line n.p = 0, n (3,) unit, towards the axis.

    Evenly spaced in undistorted coordinates; zero rows when the line does not cross the image.
    """
    b1, b2, offset = line_frame(n)
    radius = view_radius(camera, width, height) * 1.02
    if offset >= radius:
        return np.empty((0, 5))
    half = np.sqrt(radius * radius - offset * offset)
    first, last = -1, -1
    for k in range(_COARSE + 1):
        u, v = _line_pixel(camera, b1, b2, n, half * (2.0 * k / _COARSE - 1.0), 0.0)
        if _in_view(u, v, width, height):
            first = k if first < 0 else first
            last = k
    if first < 0 or last - first < 2:
        return np.empty((0, 5))
    t_first = half * (2.0 * first / _COARSE - 1.0)
    t_last = half * (2.0 * last / _COARSE - 1.0)
    step = 2.0 * half / _COARSE
    t_first = _edge_of_view(camera, b1, b2, n, t_first, t_first - step, width, height)
    t_last = _edge_of_view(camera, b1, b2, n, t_last, t_last + step, width, height)
    rows = np.empty((count, 5))
    for i in range(count):
        t = t_first + (t_last - t_first) * (i + 0.5) / count
        u, v = _line_pixel(camera, b1, b2, n, t, 0.0)
        ua, va = _line_pixel(camera, b1, b2, n, t - _STEP, 0.0)
        ub, vb = _line_pixel(camera, b1, b2, n, t + _STEP, 0.0)
        ui, vi = _line_pixel(camera, b1, b2, n, t, -_STEP)
        uo, vo = _line_pixel(camera, b1, b2, n, t, _STEP)
        nu, nv = vb - va, ua - ub
        norm = np.sqrt(nu * nu + nv * nv) + 1e-300
        length = np.sqrt((b1[0] + t * b2[0]) ** 2 + (b1[1] + t * b2[1]) ** 2 + 1.0)
        # The step along n changes n.p by _STEP at distance `length` from the camera.
        kappa = (nu * (uo - ui) + nv * (vo - vi)) / (norm * 2.0 * _STEP) * length
        if kappa < 0.0:
            nu, nv, kappa = -nu, -nv, -kappa
        rows[i, 0], rows[i, 1] = u, v
        rows[i, 2], rows[i, 3], rows[i, 4] = nu / norm, nv / norm, kappa
    return rows
