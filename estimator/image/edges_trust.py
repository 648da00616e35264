"""Whether fitted edges are the outline of the target they were fitted to, and if not, why.

Limits come from what true targets show, whose edges scatter by 0.03 px about the model on plain
images and by 0.1 to 0.3 px on cluttered, shaded and motion-blurred ones: up to 2.1 times what the
surroundings make one expect, of which up to 2.3 times in long waves along the outline.
"""

import math

import numpy as np

from estimator.image.edges_fit import LINE_NORMALS, SPHERE_NORMALS, EdgeFit, OutlineEdges
from estimator.image.edges_signs import bends_px, facing, longest_gap, round_place
from estimator.image.intrinsics import FloatArray

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
_LINE_SHAPE = (0.1, 3.0)
# Sides of a cylinder face each other, and seen at up to 60 degrees they taper to a third at most.
_MOST_ALIGNED, _LEAST_TAPER = -0.5, 0.3
_LEAST_WIDTH_PX = 14.0
# Variance in px^2 of the derivative that edges are found with (edges_profile). A blurred edge adds
# its own, and a peak's scatter grows with the cube of the width of the slope it tops.
_DERIVATIVE_PX2 = 1.1
_MOST_BLUR_PX2 = 1.4  # variance of 4 px of motion
_LEAST_SHARE_DEEP = 0.6
_FEW_WAVES, _ALL_WAVES = 5, 16


def _waves() -> FloatArray:
    """Constant, cosines and sines (1 + 2 * _ALL_WAVES, SPHERE_NORMALS) around an outline."""
    angle = 2.0 * np.pi * np.arange(SPHERE_NORMALS) / SPHERE_NORMALS
    waves = [f(k * angle) for k in range(1, _ALL_WAVES + 1) for f in (np.cos, np.sin)]
    return np.stack([np.ones(SPHERE_NORMALS), *waves])


_WAVES = _waves()
# Legendre polynomials (4, LINE_NORMALS) along a line.
_BOWS = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, LINE_NORMALS), 3).T.astype(
    np.float64, order="C"
)


def sphere_doubt(fit: EdgeFit, shape: tuple[int, int]) -> str:
    """Why the fit is no trustworthy outline of a sphere in an image of ``shape``; "" if it is."""
    edges = fit.outlines[0]
    radius_px, border_px = round_place(edges.normals, shape[1], shape[0])
    if border_px < MARGIN_PX:
        return "the sphere is partly out of view"
    if not LEAST_RADIUS_PX <= radius_px <= MOST_RADIUS_PX:
        return f"the outline's radius of {radius_px:.0f} px is out of range"
    share = edges.agreeing_share
    if share < _LEAST_SHARE_SPHERE or longest_gap(edges.agreeing, True) > _MOST_GAP_SPHERE:
        return f"only {share:.0%} of a round outline is visible"
    if edges.deep_share < _LEAST_SHARE_DEEP:
        return "the target's inside does not stand out from its surroundings"
    if edges.scale_px > _limit_px(_SCATTER, edges):
        return f"the edges scatter by {edges.scale_px:.1f} px about a sphere's outline"
    bends = bends_px(edges.residuals_px, edges.agreeing, _WAVES, 3, 1 + 2 * _FEW_WAVES)
    for limit, bend_px in zip((_SHAPE, _CORNERS), bends, strict=True):
        if bend_px > _limit_px(limit, edges):
            return f"the outline departs by {bend_px:.2f} px from a sphere's"
    return ""


def cylinder_doubt(fit: EdgeFit, blur_px2: float = 0.0) -> str:
    """Why the fit is no trustworthy pair of a cylinder's outline lines; "" if it is.

    ``blur_px2`` is the variance across the sides of motion and point spread, as far as known.
    """
    blur_px2 = min(blur_px2, _MOST_BLUR_PX2)
    widened = (1.0 + blur_px2 / _DERIVATIVE_PX2) ** 1.5
    for edges in fit.outlines:
        length_px = math.dist(edges.normals[0, :2], edges.normals[-1, :2])
        if length_px < LEAST_LINE_PX:
            return f"only {length_px:.0f} px of one of the cylinder's sides are in view"
        share = edges.agreeing_share
        if share < _LEAST_SHARE_LINE or longest_gap(edges.agreeing, False) > _MOST_GAP_LINE:
            return f"only {share:.0%} of one of the cylinder's sides is visible"
        if edges.scale_px > _limit_px(_LINE_SCATTER, edges, widened):
            return f"the edges scatter by {edges.scale_px:.1f} px about a straight line"
        _, bend_px = bends_px(edges.residuals_px, edges.agreeing, _BOWS, 2, len(_BOWS))
        if bend_px > _limit_px(_LINE_SHAPE, edges):
            return f"one side is bent by {bend_px:.2f} px"
        if edges.deep_share < _LEAST_SHARE_DEEP:
            return "the target's inside does not stand out from its surroundings"
    return _crossing_doubt(fit)


def _crossing_doubt(fit: EdgeFit) -> str:
    """A cylinder's two sides never meet in view: that would be its end at infinity."""
    one, other = (edges.normals for edges in fit.outlines)
    aligned, taper, width_px = facing(one, other)
    if aligned > _MOST_ALIGNED:
        return "the two edges found do not run alongside each other"
    if taper < _LEAST_TAPER:
        return "the two edges found meet each other in or near the view"
    if width_px < _LEAST_WIDTH_PX:
        return f"the two edges found are only {width_px:.0f} px apart"
    return ""


def _limit_px(limit: tuple[float, float], edges: OutlineEdges, widened: float = 1.0) -> float:
    return limit[0] + limit[1] * edges.expected_px * widened
