"""From a rough prediction to a robustly fitted outline, and what its edges looked like."""

from dataclasses import dataclass

import numpy as np

from estimator.image.edges_camera import GreyImage
from estimator.image.edges_cylinder import (
    consensus_line,
    cylinder_covariance,
    cylinder_of_lines,
    fit_line,
    lines_of_cylinder,
)
from estimator.image.edges_profile import BoolArray, edge_peaks, peak_rays
from estimator.image.edges_signs import appearance
from estimator.image.edges_sphere import consensus_cone, fit_cone, s_of_cone
from estimator.image.intrinsics import FloatArray
from estimator.image.outline_normals import line_normals, sphere_normals

REACH_PX = 15  # of the first search along the normals
_FINE_REACH_PX = 6
_GATE_PX = 3.0
_LEAST_GREY = 4.0
SPHERE_NORMALS = 120
LINE_NORMALS = 72


@dataclass(frozen=True, slots=True)
class OutlineEdges:
    """One closed outline or one line with the edge found nearest to it on each normal."""

    normals: FloatArray  # (n, 5): u, v, nu, nv, kappa; see outline_normals
    residuals_px: FloatArray  # (n,) outwards; NaN where there is no edge
    scale_px: float  # robust standard deviation of the residuals
    agreeing: BoolArray  # (n,) whether there is an edge where the outline says
    agreeing_share: float
    expected_px: float  # the deviations that the surroundings make one expect
    deep_share: float  # where the target's inside stands out too, not only its rim


@dataclass(frozen=True, slots=True)
class EdgeFit:
    """A target's outline fitted to edge points."""

    s: FloatArray  # (3,)
    covariance: FloatArray  # (3, 3) of s
    axis: FloatArray | None  # (3,), cylinder only
    outlines: tuple[OutlineEdges, ...]  # one for a sphere, two for a cylinder


def fit_sphere_edges(
    image: GreyImage, camera: FloatArray, s0: FloatArray, sign: float
) -> EdgeFit | None:
    """The sphere's outline near that of s0 (3,), or None when the edges agree on none.

    ``camera`` is a packed one; ``sign`` is +1 for a target brighter than its surroundings.
    The guess may be wrong by up to REACH_PX.
    """
    if not s0 @ s0 > 1.0:
        return None
    normals = sphere_normals(camera, s0, SPHERE_NORMALS)
    offsets, strengths = edge_peaks(image, normals, REACH_PX, sign, _LEAST_GREY)
    rays = peak_rays(camera, normals, offsets, strengths)
    w, score = consensus_cone(rays, strengths, normals, s0, 1)
    if score <= 0.0:
        return None
    w, inverse, residuals, scale, fitted = fit_cone(rays, strengths, normals, w, _GATE_PX)
    if not fitted:
        return None
    normals = sphere_normals(camera, w / np.sqrt(w @ w - 1.0), SPHERE_NORMALS)
    offsets, strengths = edge_peaks(image, normals, _FINE_REACH_PX, sign, _LEAST_GREY)
    rays = peak_rays(camera, normals, offsets, strengths)
    w, inverse, residuals, scale, fitted = fit_cone(rays, strengths, normals, w, _GATE_PX)
    if not fitted:
        return None
    s, covariance = s_of_cone(w, scale * scale * inverse)
    return EdgeFit(s, covariance, None, (_seen(image, normals, residuals, scale, sign),))


def fit_cylinder_edges(
    image: GreyImage, camera: FloatArray, s0: FloatArray, axis0: FloatArray, sign: float
) -> EdgeFit | None:
    """The cylinder's two lines near those of s0 and axis0 (3,), or None; see fit_sphere_edges."""
    if not s0 @ s0 > 1.0:
        return None
    fits = [_fit_side(image, camera, n, sign) for n in lines_of_cylinder(s0, axis0)]
    one, other = fits
    if one is None or other is None or abs(one[0] @ other[0]) > 1.0 - 1e-9:
        return None
    s, axis = cylinder_of_lines(one[0], other[0])
    if not s[2] > 0.0 or not s @ s > 1.0:
        return None
    covariance = cylinder_covariance(one[0], other[0], one[1], other[1])
    return EdgeFit(s, covariance, axis, (one[2], other[2]))


def _fit_side(
    image: GreyImage, camera: FloatArray, n0: FloatArray, sign: float
) -> tuple[FloatArray, FloatArray, OutlineEdges] | None:
    """Plane normal n (3,), its covariance and the edges of one side near n0."""
    height, width = image.shape
    n = n0
    for reach in (REACH_PX, _FINE_REACH_PX):
        normals = line_normals(camera, n, LINE_NORMALS, width, height)
        if len(normals) == 0:
            return None
        offsets, strengths = edge_peaks(image, normals, reach, sign, _LEAST_GREY)
        rays = peak_rays(camera, normals, offsets, strengths)
        if reach == REACH_PX:
            n, score = consensus_line(rays, strengths, normals, n, 1)
            if score <= 0.0:
                return None
        n, inverse, residuals, scale, fitted = fit_line(rays, strengths, normals, n, _GATE_PX)
        if not fitted:
            return None
    return n, scale * scale * inverse, _seen(image, normals, residuals, scale, sign)


def _seen(
    image: GreyImage, normals: FloatArray, residuals: FloatArray, scale: float, sign: float
) -> OutlineEdges:
    agreeing, share, expected_px, deep = appearance(image, normals, residuals, scale, sign)
    return OutlineEdges(normals, residuals, scale, agreeing, share, expected_px, deep)
