"""The last step of a measurement: the refined outline, held against the edges it started from."""

import numpy as np

from estimator.image.edges_camera import GreyImage
from estimator.image.edges_cylinder import cylinder_covariance, lines_of_cylinder
from estimator.image.edges_fit import EdgeFit, OutlineEdges
from estimator.image.edges_profile import MAX_PEAKS, peak_rays
from estimator.image.edges_trust import agreeing_edges
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.image.limb_fit import LimbFit, refine_cylinder, refine_sphere

# Edge points sit up to 0.3 px off on shaded and motion-blurred outlines, the refinement does not.
_MOST_SHIFT_PX, _MOST_SHIFT_PER_EXPECTED = 0.2, 4.0
_LEAST_USABLE, _MOST_CHI2 = 0.6, 4.0
# Clean, refined cylinders with sides along the pixel grid were 0.003 to 0.009 px off (5 images).
_GRID_PX = 0.01
_CLEAR_SHARE, _CLEAR_SCATTER_PX, _SYSTEMATIC_PX = 0.93, 0.15, 0.08


def refined(
    image: GreyImage, intrinsics: Intrinsics, camera: FloatArray, fit: EdgeFit
) -> Measurement:
    """The feature of a certified edge fit, refined, or why the refinement is not to be trusted."""
    if fit.axis is None:
        limb = refine_sphere(image, intrinsics, fit.s)
    else:
        limb = refine_cylinder(image, intrinsics, fit.s, fit.axis)
    doubt = _limb_doubt(limb, camera, fit)
    clear = all(
        np.mean(agreeing_edges(edges)) >= _CLEAR_SHARE and edges.scale_px <= _CLEAR_SCATTER_PX
        for edges in fit.outlines
    )
    if limb is not None and not doubt and (limb.converged or not clear):
        covariance = limb.covariance + _grid_covariance(fit, limb, intrinsics.fx_px)
        return Measurement(Feature(limb.s, covariance, limb.axis))
    # Sides along the pixel grid can leave the refinement without a solution; edges that are all
    # there and agree closely still measure, less precisely.
    if clear:
        return Measurement(Feature(fit.s, _edge_covariance(fit, intrinsics.fx_px), fit.axis))
    return Measurement(None, doubt)


def _limb_doubt(limb: LimbFit | None, camera: FloatArray, fit: EdgeFit) -> str:
    """Why a refinement is not to be trusted; "" if it is."""
    if limb is None:
        return "the outline's pixels fit no edge"
    if limb.usable_fraction < _LEAST_USABLE:
        return f"only {limb.usable_fraction:.0%} of the outline's pixels fit a target's edge"
    if limb.chi2 > _MOST_CHI2:
        return "the outline's pixels depart from a target's edge"
    for side, edges in enumerate(fit.outlines):
        expected_px = float(np.mean(edges.expected_px))
        most_px = _MOST_SHIFT_PX + _MOST_SHIFT_PER_EXPECTED * expected_px
        if not _shift_px(edges, camera, limb, side) <= most_px:
            return "the outline's edges and pixels disagree on where it is"
    return ""


def _grid_covariance(fit: EdgeFit, limb: LimbFit, focal_px: float) -> FloatArray:
    """What is added (3, 3) where a side runs along the pixel grid.

    There one column of pixels shows the whole edge at one phase, and what the profile is off at
    that phase does not average out, as it does once the side crosses a few columns.
    """
    if limb.axis is None:
        return np.zeros((3, 3))
    normals = lines_of_cylinder(limb.s, limb.axis)
    spread = []
    for n, edges in zip(normals, fit.outlines, strict=True):
        crossed_px = float(np.ptp(edges.normals[:, :2], axis=0).min())
        angle = _GRID_PX / (1.0 + crossed_px**2) / focal_px
        across = np.cross(limb.axis, n)
        spread.append(angle**2 * np.outer(across, across))
    return cylinder_covariance(normals[0], normals[1], spread[0], spread[1])


def _edge_covariance(fit: EdgeFit, focal_px: float) -> FloatArray:
    """The edges' covariance (3, 3) with what shading and blur may have moved them by."""
    angle = _SYSTEMATIC_PX / focal_px
    if fit.axis is not None:
        n1, n2 = lines_of_cylinder(fit.s, fit.axis)
        spread = [angle**2 * (np.eye(3) - np.outer(n, n)) for n in (n1, n2)]
        return fit.covariance + cylinder_covariance(n1, n2, spread[0], spread[1])
    norm = float(np.linalg.norm(fit.s))
    towards = np.outer(fit.s, fit.s) / norm**2
    # |s| = 1 / sin(theta): an error of the half-angle theta grows by |s| sqrt(|s|^2 - 1).
    return (
        fit.covariance
        + (angle * norm) ** 2 * (norm**2 - 1.0) * towards
        + (angle * norm) ** 2 * (np.eye(3) - towards)
    )


def _shift_px(edges: OutlineEdges, camera: FloatArray, limb: LimbFit, side: int) -> float:
    """How far the refined outline lies from the edges' one, at most."""
    none = np.zeros((len(edges.normals), MAX_PEAKS))
    one = none.copy()
    one[:, 0] = 1.0
    rays = peak_rays(camera, edges.normals, none, one)[:, 0]
    if limb.axis is None:
        q = np.sqrt(float(limb.s @ limb.s) - 1.0)
        shifts = (1.0 - rays @ limb.s / q) / (1.0 / q)
    else:
        shifts = rays @ lines_of_cylinder(limb.s, limb.axis)[side]
    return float(np.max(np.abs(edges.normals[:, 4] * shifts)))
