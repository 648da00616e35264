"""Whether fitted edges are the outline of the target they were fitted to, and if not, why.

Limits come from what true targets show, whose edges scatter by 0.03 px about the model on plain
images and by 0.1 to 0.3 px on cluttered, shaded and motion-blurred ones: up to 2.1 times what the
surroundings make one expect, of which up to 2.3 times in long waves along the outline.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.image.edges_fit import EdgeFit, OutlineEdges
from estimator.image.edges_profile import NOISE_MOST_PX
from estimator.image.intrinsics import FloatArray

BoolArray = NDArray[np.bool_]

MARGIN_PX = 3.0  # an outline this near to the border counts as partly out of view
LEAST_RADIUS_PX, MOST_RADIUS_PX = 8.0, 300.0
LEAST_LINE_PX = 100.0
_LEAST_SHARE_SPHERE, _MOST_GAP_SPHERE = 0.72, 0.16  # of the outline
_LEAST_SHARE_LINE, _MOST_GAP_LINE = 0.7, 0.25
# (base, per expected scatter): all scatter, waves of 2 to 5 and of 2 to 16 periods.
_SCATTER = (0.09, 2.3)
_SHAPE = (0.05, 2.4)
_CORNERS = (0.1, 3.2)
# Lines nearly along the pixel grid show its steps as long waves of up to 0.08 px.
_LINE_SCATTER = (0.13, 2.3)
_LINE_SHAPE = (0.1, 2.6)
_RIDGE = 2.0
# Sides of a cylinder face each other, and seen at up to 60 degrees they taper to a third at most.
_MOST_ALIGNED, _LEAST_TAPER = -0.5, 0.3
_LEAST_WIDTH_PX = 14.0
_LEAST_SHARE_DEEP = 0.6
_AGREE_PX, _AGREE_SCALES = (0.6, 1.5), 4.0


def sphere_doubt(fit: EdgeFit, shape: tuple[int, int]) -> str:
    """Why the fit is no trustworthy outline of a sphere in an image of ``shape``; "" if it is."""
    edges = fit.outlines[0]
    radius_px = _mean_radius_px(edges.normals)
    if _border_distance_px(edges.normals, shape) < MARGIN_PX:
        return "the sphere is partly out of view"
    if not LEAST_RADIUS_PX <= radius_px <= MOST_RADIUS_PX:
        return f"the outline's radius of {radius_px:.0f} px is out of range"
    agreeing = agreeing_edges(edges)
    share, gap = float(np.mean(agreeing)), _longest_gap(agreeing, closed=True)
    if share < _LEAST_SHARE_SPHERE or gap > _MOST_GAP_SPHERE:
        return f"only {share:.0%} of a round outline is visible"
    if float(np.mean(edges.deep)) < _LEAST_SHARE_DEEP:
        return "the target's inside does not stand out from its surroundings"
    if edges.scale_px > _limit_px(_SCATTER, edges):
        return f"the edges scatter by {edges.scale_px:.1f} px about a sphere's outline"
    angle = 2.0 * np.pi * np.arange(len(agreeing)) / len(agreeing)
    for limit, waves in ((_SHAPE, 5), (_CORNERS, 16)):
        shapes = [np.ones(len(angle))]
        shapes += [f(k * angle) for k in range(1, waves + 1) for f in (np.cos, np.sin)]
        bend_px = _systematic_px(edges, agreeing, np.stack(shapes, axis=1), 3)
        if bend_px > _limit_px(limit, edges):
            return f"the outline departs by {bend_px:.2f} px from a sphere's"
    return ""


def cylinder_doubt(fit: EdgeFit) -> str:
    """Why the fit is no trustworthy pair of a cylinder's outline lines; "" if it is."""
    for edges in fit.outlines:
        ends = edges.normals[[0, -1], :2]
        length_px = float(np.hypot(*(ends[1] - ends[0])))
        if length_px < LEAST_LINE_PX:
            return f"only {length_px:.0f} px of one of the cylinder's sides are in view"
        agreeing = agreeing_edges(edges)
        share, gap = float(np.mean(agreeing)), _longest_gap(agreeing, closed=False)
        if share < _LEAST_SHARE_LINE or gap > _MOST_GAP_LINE:
            return f"only {share:.0%} of one of the cylinder's sides is visible"
        if edges.scale_px > _limit_px(_LINE_SCATTER, edges):
            return f"the edges scatter by {edges.scale_px:.1f} px about a straight line"
        t = np.linspace(-1.0, 1.0, len(agreeing))
        shapes = np.polynomial.legendre.legvander(t, 3).astype(np.float64)
        bend_px = _systematic_px(edges, agreeing, shapes, 2)
        if bend_px > _limit_px(_LINE_SHAPE, edges):
            return f"one side is bent by {bend_px:.2f} px"
        if float(np.mean(edges.deep)) < _LEAST_SHARE_DEEP:
            return "the target's inside does not stand out from its surroundings"
    return _crossing_doubt(fit)


def agreeing_edges(edges: OutlineEdges) -> BoolArray:
    """Which normals (n,) carry an edge where the outline says."""
    limit = float(np.clip(_AGREE_SCALES * edges.scale_px, *_AGREE_PX))
    stands_out = edges.expected_px < NOISE_MOST_PX
    with np.errstate(invalid="ignore"):
        agreeing: BoolArray = (np.abs(edges.residuals_px) < limit) & stands_out
    return agreeing


def _crossing_doubt(fit: EdgeFit) -> str:
    """A cylinder's two sides never meet in view: that would be its end at infinity."""
    one, other = (edges.normals for edges in fit.outlines)
    if float(one[0, 2:4] @ other[0, 2:4]) > _MOST_ALIGNED:
        return "the two edges found do not run alongside each other"
    for here, there in ((one, other), (other, one)):
        apart_px = -np.sum((there[[0, -1], :2] - here[[0, -1], :2]) * here[[0, -1], 2:4], axis=1)
        if apart_px.min() < _LEAST_TAPER * apart_px.max():
            return "the two edges found meet each other in or near the view"
        if apart_px.max() < _LEAST_WIDTH_PX:
            return f"the two edges found are only {apart_px.max():.0f} px apart"
    return ""


def _mean_radius_px(normals: FloatArray) -> float:
    centre = normals[:, :2].mean(axis=0)
    return float(np.mean(np.hypot(*(normals[:, :2] - centre).T)))


def _border_distance_px(normals: FloatArray, shape: tuple[int, int]) -> float:
    u, v = normals[:, 0], normals[:, 1]
    return float(min(u.min(), v.min(), shape[1] - 1.0 - u.max(), shape[0] - 1.0 - v.max()))


def _longest_gap(agreeing: BoolArray, closed: bool) -> float:
    """The longest run without agreement, as a share of all."""
    places = np.flatnonzero(agreeing)
    if len(places) == 0:
        return 1.0
    if closed:
        runs = np.diff(np.append(places, places[0] + len(agreeing))) - 1
    else:
        runs = np.diff(np.concatenate([[-1], places, [len(agreeing)]])) - 1
    return float(runs.max()) / len(agreeing)


def _limit_px(limit: tuple[float, float], edges: OutlineEdges) -> float:
    return limit[0] + limit[1] * float(np.mean(edges.expected_px))


def _systematic_px(
    edges: OutlineEdges,
    agreeing: BoolArray,
    shapes: FloatArray,
    free: int,
) -> float:
    """Size of the residuals' part along ``shapes`` (n, k) beyond the first ``free`` ones."""
    a = shapes[agreeing]
    # The ridge keeps waves small that only the gaps in the outline could tell.
    normal = a.T @ a + _RIDGE * np.eye(a.shape[1])
    coefficients = np.linalg.solve(normal, a.T @ edges.residuals_px[agreeing])
    return float(np.linalg.norm(coefficients[free:]))
