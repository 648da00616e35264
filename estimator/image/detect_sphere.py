"""Detection of spheres from scratch: candidates for s, most likely first."""

import numpy as np

from estimator.image.detect_circles import fit_circle, vote_circles
from estimator.image.detect_contrast import side_contrast
from estimator.image.detect_grid import DetectGrid, edge_list, reduce_image
from estimator.image.edges_camera import GreyImage
from estimator.image.intrinsics import FloatArray
from estimator.image.outline_normals import sphere_normals

Circle = tuple[float, float, float, float]  # x, y, radius, share

LEAST_RADIUS_PX = 14.0
MOST_RADIUS_PX = 250.0
_LEAST_SLOPE_GREY = 2.5  # per reduced pixel
_MOST_EDGES = 3000
_ROUGH = 24
_LEAST_SHARE = 0.35
_CANDIDATES = 4
_NORMALS = 48


def detect_spheres(
    image: GreyImage, grid: DetectGrid, camera: FloatArray, sign: float = 1.0
) -> list[FloatArray]:
    """Candidates for s (3,), best first, from an image and its stereographic grid.

    ``sign`` +1 looks for targets brighter than their surroundings, -1 for darker ones. Only
    outlines whose centre is in view are found; each is good to about 2 px.
    """
    small = reduce_image(image, grid.factor)
    edges = edge_list(small, grid.xy, grid.gradient, _LEAST_SLOPE_GREY, _MOST_EDGES)
    if len(edges) < 8:
        return []
    corners = grid.xy[[0, 0, -1, -1], [0, -1, 0, -1]]
    bounds = np.concatenate([corners.min(axis=0), corners.max(axis=0)])
    low, high = LEAST_RADIUS_PX / grid.factor, MOST_RADIUS_PX / grid.factor
    rough = vote_circles(edges, max(low, 3.0), high, sign, bounds, _ROUGH)
    distinct: list[Circle] = []
    for circle in (fit_circle(edges, guess, sign) for guess in rough):
        usable = circle[3] >= _LEAST_SHARE and low <= circle[2] <= high
        if usable and all(not _same(circle, other) for other in distinct):
            distinct.append(circle)
    scored: list[tuple[float, FloatArray]] = []
    for x, y, radius, _ in distinct:
        s = _s_of_circle(grid, x, y, radius)
        contrast = sign * side_contrast(image, sphere_normals(camera, s, _NORMALS))
        # Long outlines are rarer by chance than short ones of the same contrast.
        scored.append((contrast * radius**0.25, s))
    scored.sort(key=lambda item: -item[0])
    return [s for _, s in scored[:_CANDIDATES]]


def _same(a: Circle, b: Circle) -> bool:
    return abs(a[0] - b[0]) + abs(a[1] - b[1]) + abs(a[2] - b[2]) < 2.0 + 0.05 * b[2]


def _s_of_circle(grid: DetectGrid, x: float, y: float, radius: float) -> FloatArray:
    """s (3,) of the sphere whose outline is a circle of the stereographic plane."""
    far = float(np.hypot(x, y))
    ex, ey = (x / far, y / far) if far > 0.0 else (1.0, 0.0)
    # The circle's diameter through the origin keeps the cone's axis between its two ends.
    near_ray = grid.ray(x - radius * ex, y - radius * ey)
    far_ray = grid.ray(x + radius * ex, y + radius * ey)
    middle = near_ray + far_ray
    middle /= np.linalg.norm(middle)
    sine = float(np.linalg.norm(np.cross(middle, far_ray)))
    return middle / sine
