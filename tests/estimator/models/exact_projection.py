"""What a camera at the origin sees of a sphere and a cylinder, and s read back from the image.

Written from the geometry of tangent rays and planes alone, so that the models are checked
against images, not against their own equations.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def _across(direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors that complete ``direction`` to an orthogonal frame."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    first = np.cross(direction, helper)
    first /= np.linalg.norm(first)
    return first, np.cross(direction, first)


def sphere_outline(centre_m: FloatArray, radius_m: float, count: int = 24) -> FloatArray:
    """Image points (n, 2) of the rays tangent to a sphere."""
    distance = float(np.linalg.norm(centre_m))
    towards = centre_m / distance
    half_angle = np.arcsin(radius_m / distance)
    first, second = _across(towards)
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)[:, None]
    rays = np.cos(half_angle) * towards + np.sin(half_angle) * (
        np.cos(turn) * first + np.sin(turn) * second
    )
    outline: FloatArray = rays[:, :2] / rays[:, 2:]
    return outline


def sphere_s(outline: FloatArray) -> FloatArray:
    """s from the conic through an outline: λ1/λ2 of its matrix tells ‖s‖, the eigenvector s."""
    x, y = outline.T
    design = np.stack((x * x, 2 * x * y, y * y, 2 * x, 2 * y, np.ones_like(x)), axis=-1)
    a, b, c, d, e, f = np.linalg.svd(design)[2][-1]
    eigenvalues, eigenvectors = np.linalg.eigh(np.array([[a, b, d], [b, c, e], [d, e, f]]))
    odd = 0 if eigenvalues[0] * eigenvalues[1] < 0.0 else 2  # the one of the other sign
    pair = float(np.delete(eigenvalues, odd).mean())
    towards = eigenvectors[:, odd] * np.sign(eigenvectors[2, odd])
    s: FloatArray = towards * np.sqrt(1.0 - pair / eigenvalues[odd])
    return s


def cylinder_lines(
    point_m: FloatArray, axis: FloatArray, radius_m: float
) -> tuple[FloatArray, FloatArray]:
    """The two outlines (cos θ, sin θ, −ρ) of a cylinder, as lines come: of either sign."""
    P0 = point_m - axis * float(axis @ point_m)
    distance = float(np.linalg.norm(P0))
    sideways = np.cross(axis, P0) / distance
    half_angle = np.arcsin(radius_m / distance)
    normals = [
        np.sin(half_angle) * P0 / distance + side * np.cos(half_angle) * sideways
        for side in (1.0, -1.0)
    ]
    lines = [n / np.hypot(n[0], n[1]) * np.sign(n[0]) for n in normals]
    return lines[0], lines[1]


def orient(n1: FloatArray, n2: FloatArray, inside: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Both line normals turned towards an image point (3,) between the lines."""
    return n1 * np.sign(n1 @ inside), n2 * np.sign(n2 @ inside)


def cylinder_s_and_axis(n1: FloatArray, n2: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(15)-(18): s = Δ/‖Δ‖² and a, of two oriented lines."""
    delta = 0.5 * (n1 / np.linalg.norm(n1) + n2 / np.linalg.norm(n2))
    across = np.cross(n2, n1)
    s: FloatArray = delta / float(delta @ delta)
    a: FloatArray = across / np.linalg.norm(across)
    return s, a
