"""Exact outlines and shading of spheres and cylinders, as kernels over single rays.

A solid seen from one pose is a row of ``ROW`` numbers in the camera frame, see ``prepare``.
Rays are (x, y, 1). A ray's signed distance to an outline is in pixels, positive inside.
"""

import numpy as np
from numpy.typing import NDArray

from sim_backend.jit import jit

FloatArray = NDArray[np.float64]

SPHERE, CYLINDER, UNSEEN = 0.0, 1.0, -1.0
FAR_OUTSIDE_PX = -1e6
# Columns of a packed solid, in base, and of a prepared row, in the camera frame:
# 0 kind | 1:4 centre or middle | 4:7 axis | 7 radius | 8 half length | 9 albedo
PACKED = 10
# Prepared rows go on with 10:13 what gives the lit share of the surface at z (x, y, 1) as
# z (x, y, 1)·row[10:13] - row[23] | 13 tangent of the sphere's half angle | 14:17, 17:20 normals
# of the cylinder's tangent planes, towards the axis | 20:23 centre or axis point nearest the
# camera | 24 lit share of the end the axis points to | 25 ambient and 26 most directed radiance
# | 27 squared distance to 20:23 less squared radius | 28 position along the axis of 20:23
ROW = 29


@jit
def prepare(
    solid: FloatArray, T: FloatArray, light: FloatArray, ambient: float, row: FloatArray
) -> None:
    """Fill ``row`` with ``solid`` as seen from the pose T_base_camera."""
    R = np.ascontiguousarray(T[:3, :3].T)
    row[:PACKED] = solid
    row[1:4] = R @ (solid[1:4] - T[:3, 3])
    row[4:7] = R @ solid[4:7]
    row[25], row[26] = solid[9] * ambient, solid[9] * (1.0 - ambient)
    light_seen = R @ light
    radius, a = row[7], row[4:7]
    row[24] = np.sum(a * light_seen)
    across = light_seen - row[24] * a  # a is zero for a sphere
    row[10:13] = across / radius
    row[23] = np.sum(row[1:4] * across) / radius
    along = np.sum(row[1:4] * a)
    row[28] = -along
    nearest = row[1:4] - along * a
    row[20:23] = nearest
    distance2 = np.sum(nearest * nearest)
    row[27] = distance2 - radius * radius
    if row[27] <= 0.0:
        row[0] = UNSEEN  # the camera is inside
        return
    row[13] = radius / np.sqrt(row[27])
    e = nearest / np.sqrt(distance2)
    sin = radius / np.sqrt(distance2)
    cos = np.sqrt(1.0 - sin * sin)
    side = np.cross(a, e)
    row[14:17] = sin * e + cos * side
    row[17:20] = sin * e - cos * side


@jit
def rough_distance(row: FloatArray, x: float, y: float) -> float:
    """A ray's distance inside a solid's outline, to a third, times the focal length."""
    if row[0] == CYLINDER:
        first = x * row[14] + y * row[15] + row[16]
        return float(min(first, x * row[17] + y * row[18] + row[19]))
    m = x * row[20] + y * row[21] + row[22]
    if row[0] == UNSEEN or m <= 0.0:
        return FAR_OUTSIDE_PX
    c2 = row[27] + row[7] * row[7]
    return float(row[13] - np.sqrt(max((x * x + y * y + 1.0) * c2 - m * m, 0.0)) / m)


@jit
def outline(row: FloatArray, x: float, y: float, J: FloatArray, out: FloatArray) -> None:
    """Signed distances to a solid's outline: out = distance, unit gradient (2), sag, other.

    ``J`` (4,) is d(x, y)/d(u, v) row by row. ``sag`` is 1/(24 r) for the outline's radius of
    curvature r in pixels; ``other`` the distance to the cylinder's second line. The cylinder
    is taken as endless.
    """
    if row[0] == SPHERE:
        _sphere_outline(row, x, y, J, out)
        return
    out[0] = np.inf
    for side in range(2):
        o = 14 + 3 * side
        gx, gy = row[o], row[o + 1]
        gu, gv = gx * J[0] + gy * J[2], gx * J[1] + gy * J[3]
        norm = max(np.sqrt(gu * gu + gv * gv), 1e-12)
        distance = (gx * x + gy * y + row[o + 2]) / norm
        if distance < out[0]:
            out[4] = out[0]
            out[0], out[1], out[2] = distance, gu / norm, gv / norm
        else:
            out[4] = distance
    out[3] = 0.0


@jit
def _sphere_outline(row: FloatArray, x: float, y: float, J: FloatArray, out: FloatArray) -> None:
    cx, cy, cz = row[20], row[21], row[22]
    m = x * cx + y * cy + cz
    out[1], out[2], out[3], out[4] = 1.0, 0.0, 0.0, -FAR_OUTSIDE_PX
    if m <= 0.0:
        out[0] = FAR_OUTSIDE_PX
        return
    # The tangent of the angle to the centre: nearly linear in pixels along the normal, unlike
    # the quadratic form of the cone, so first-order distances stay good to 1e-4 px.
    c2 = cx * cx + cy * cy + cz * cz
    root = np.sqrt(max((x * x + y * y + 1.0) * c2 - m * m, 1e-18 * c2))
    gx = (x * c2 - m * cx) / (root * m) - root * cx / (m * m)
    gy = (y * c2 - m * cy) / (root * m) - root * cy / (m * m)
    gu, gv = gx * J[0] + gy * J[2], gx * J[1] + gy * J[3]
    norm = max(np.sqrt(gu * gu + gv * gv), 1e-12)
    out[0] = (row[13] - root / m) / norm
    out[1], out[2] = -gu / norm, -gv / norm
    out[3] = norm / (24.0 * row[13])


@jit
def hit(row: FloatArray, x: float, y: float, span: FloatArray) -> float:
    """Depth z at which a ray meets the solid's lateral surface; grazes it when it misses.

    For a cylinder ``span`` (2,) receives the positions along the axis of entry and exit.
    """
    pa = x * row[4] + y * row[5] + row[6]  # zero for a sphere
    p2 = max(x * x + y * y + 1.0 - pa * pa, 1e-12)
    m = x * row[20] + y * row[21] + row[22]
    root = np.sqrt(max(m * m - p2 * row[27], 0.0))
    z = (m - root) / p2
    span[0] = z * pa + row[28]
    span[1] = (m + root) / p2 * pa + row[28]
    return float(z)


@jit
def may_end(row: FloatArray, span: FloatArray, z: float, focal_px: float) -> bool:
    """Whether a cylinder's end may lie within some pixels of the ray that ``hit`` it."""
    if row[0] == SPHERE:
        return False
    return bool(max(abs(span[0]), abs(span[1])) > row[8] - 0.25 * row[7] - 4.0 * z / focal_px)


@jit
def shade(row: FloatArray, x: float, y: float, z: float) -> float:
    """Lambert radiance of the lateral surface at the point z (x, y, 1)."""
    lit = z * (x * row[10] + y * row[11] + row[12]) - row[23]
    return float(row[25] + row[26] * max(lit, 0.0))


@jit
def fill_solid(image: NDArray[np.float32], rays: NDArray[np.float32], row: FloatArray) -> None:
    """Set ``image`` (h, w), whose ``rays`` (2, h, w) all meet the solid, to its radiance."""
    span = np.zeros(2)
    for v in range(image.shape[0]):
        line, xs, ys = image[v], rays[0, v], rays[1, v]
        for u in range(line.size):
            x, y = float(xs[u]), float(ys[u])
            line[u] = shade(row, x, y, hit(row, x, y, span))


@jit
def hit_with_ends(row: FloatArray, x: float, y: float, result: FloatArray) -> bool:
    """Whether a ray meets the finite cylinder; ``result`` gets its depth and radiance."""
    if row[14] * x + row[15] * y + row[16] <= 0.0 or row[17] * x + row[18] * y + row[19] <= 0.0:
        return False
    span = np.zeros(2)
    z = hit(row, x, y, span)
    half = row[8]
    if abs(span[0]) <= half:
        result[0], result[1] = z, shade(row, x, y, z)
        return True
    end = np.sign(span[0])
    if end * span[1] >= half:
        return False  # it passes beyond the end
    pa = x * row[4] + y * row[5] + row[6]
    result[0] = (end * half - row[28]) / pa
    result[1] = row[25] + row[26] * max(end * row[24], 0.0)
    return True
