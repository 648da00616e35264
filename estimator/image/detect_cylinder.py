"""Detection of cylinders from scratch: candidates for s and the axis, most likely first."""

from dataclasses import dataclass

import numpy as np

from estimator.image.detect_contrast import side_contrast
from estimator.image.detect_grid import DetectGrid, edge_list, reduce_image
from estimator.image.detect_lines import fit_edge_line, vote_lines
from estimator.image.edges_camera import GreyImage
from estimator.image.edges_cylinder import cylinder_of_lines
from estimator.image.intrinsics import FloatArray
from estimator.image.outline_normals import line_normals

LEAST_WIDTH_PX = 24.0
MOST_WIDTH_PX = 480.0
_LEAST_SLOPE_GREY = 2.5  # per reduced pixel
_MOST_EDGES = 3000
_LINES = 22
_CANDIDATES = 4
# Planes touching a cylinder at |s| > 2 meet at less than 60 degrees.
_LEAST_FACING = 0.5
_LEAST_CONTRAST = 0.12
_NORMALS = 48
# Another side between two means that they belong to different things.
_STRONG, _BETWEEN_COST = 0.75, 0.1


@dataclass(frozen=True, slots=True)
class _Side:
    """A long edge: its plane's normal towards the bright side, and how well it stands out."""

    n: FloatArray  # (3,) unit
    contrast: float  # 0 to 1
    weight: float


def detect_cylinders(
    image: GreyImage, grid: DetectGrid, camera: FloatArray, sign: float = 1.0
) -> list[tuple[FloatArray, FloatArray]]:
    """Candidates for (s, axis), each (3,), best first, from an image and its pinhole grid.

    ``sign`` +1 looks for targets brighter than their surroundings, -1 for darker ones.
    """
    small = reduce_image(image, grid.factor)
    edges = edge_list(small, grid.xy, grid.gradient, _LEAST_SLOPE_GREY, _MOST_EDGES)
    if len(edges) < 8:
        return []
    radius = float(np.max(np.linalg.norm(grid.xy[[0, 0, -1, -1], [0, -1, 0, -1]], axis=-1)))
    sides: list[_Side] = []
    for rough in vote_lines(edges, radius, _LINES):
        angle, offset, weight = fit_edge_line(edges, rough)
        if weight <= 0.0:
            continue
        n = sign * np.array([np.cos(angle), np.sin(angle), -offset / grid.scale_px])
        n /= np.linalg.norm(n)
        rows = line_normals(camera, n, _NORMALS, image.shape[1], image.shape[0])
        if len(rows) == 0:
            continue
        contrast = sign * side_contrast(image, rows)
        if contrast > _LEAST_CONTRAST and all(side.n @ n < 0.9998 for side in sides):
            sides.append(_Side(n, contrast, weight))
    return _pairs(sides, grid)


def _pairs(sides: list[_Side], grid: DetectGrid) -> list[tuple[FloatArray, FloatArray]]:
    """Pairs of facing sides with no other strong side between them, best first."""
    scored: list[tuple[float, FloatArray, FloatArray]] = []
    focal_px = grid.scale_px * grid.factor
    for i, one in enumerate(sides):
        for other in sides[i + 1 :]:
            # Both normals point to the axis: as seen from the axis they face each other.
            if one.n[:2] @ other.n[:2] > -_LEAST_FACING * _length(one) * _length(other):
                continue
            delta = one.n + other.n
            distance = 2.0 / float(np.linalg.norm(delta))
            s, axis = cylinder_of_lines(one.n, other.n)
            width_px = 2.0 * focal_px / np.sqrt(max(distance**2 - 1.0, 1e-6))
            if s[2] <= 0.0 or not LEAST_WIDTH_PX < width_px < MOST_WIDTH_PX:
                continue
            weaker = min(one.contrast, other.contrast)
            between = sum(
                side.contrast > _STRONG * weaker and _lies_between(side, s, axis) for side in sides
            )
            score = weaker + 0.5 * (one.contrast + other.contrast) - _BETWEEN_COST * between
            scored.append((score, s, axis))
    scored.sort(key=lambda item: -item[0])
    return [(s, axis) for _, s, axis in scored[:_CANDIDATES]]


def _length(side: _Side) -> float:
    return float(np.hypot(side.n[0], side.n[1]))


def _lies_between(side: _Side, s: FloatArray, axis: FloatArray) -> bool:
    """Whether a side runs along the inside of a cylinder's outline, well off its borders."""
    across = s / np.linalg.norm(s)
    along = abs(side.n @ axis)
    # A plane through the camera that (nearly) contains the axis direction, cutting the body.
    return bool(along < 0.15 and abs(side.n @ across) < 0.85 / np.linalg.norm(s))
