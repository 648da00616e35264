"""The last step of a measurement: the refined outline, held against the edges it started from."""

import numpy as np

from estimator.image.edges_camera import GreyImage
from estimator.image.edges_cylinder import cross, cylinder_covariance, lines_of_cylinder
from estimator.image.edges_fit import EdgeFit
from estimator.image.edges_signs import cone_shift_px, line_shift_px
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.image.limb_fit import LimbFit, refine_cylinder, refine_sphere
from estimator.jit import jit

# Edge points sit up to 0.35 px off on shaded and motion-blurred outlines, most on small ones; the
# refinement does not.
_MOST_SHIFT_PX, _MOST_SHIFT_PER_EXPECTED = 0.5, 4.0
_LEAST_USABLE, _MOST_CHI2 = 0.6, 4.0
# Clean, refined cylinders with sides along the pixel grid were 0.003 to 0.009 px off (5 images).
_GRID_PX = 0.01
_CLEAR_SHARE, _CLEAR_SCATTER_PX, _SYSTEMATIC_PX = 0.93, 0.15, 0.08


def refined(
    image: GreyImage, intrinsics: Intrinsics, camera: FloatArray, fit: EdgeFit,
    learnt: FloatArray | None = None,
) -> tuple[Measurement, FloatArray | None]:  # fmt: skip
    """The feature of a certified edge fit, refined, or why the refinement is not to be trusted.

    ``learnt`` is what the image before taught of blur and noise (`LimbFit.learnt`) or None; with
    the result comes what this one did.
    """
    limb = _limb(image, intrinsics, fit, learnt)
    doubt = _limb_doubt(limb, camera, fit)
    if doubt and learnt is not None:
        limb = _limb(image, intrinsics, fit, None)
        doubt = _limb_doubt(limb, camera, fit)
    clear = all(
        edges.agreeing_share >= _CLEAR_SHARE and edges.scale_px <= _CLEAR_SCATTER_PX
        for edges in fit.outlines
    )
    if limb is not None and not doubt and (limb.converged or not clear):
        covariance = limb.covariance
        if limb.axis is not None:
            one, other = (edges.normals for edges in fit.outlines)
            covariance = covariance + _grid_covariance(
                limb.s, limb.axis, one, other, intrinsics.fx_px
            )
        feature = Feature(limb.s, covariance, limb.axis)
        return Measurement(feature), limb.learnt if limb.converged else None
    # Sides along the pixel grid can leave the refinement without a solution; edges that are all
    # there and agree closely still measure, less precisely.
    if clear:
        settled = limb if limb is not None and limb.converged else None
        apart_px = max(_SYSTEMATIC_PX, *_shifts_px(settled, camera, fit))
        covariance = _edge_covariance(fit, intrinsics.fx_px, apart_px)
        return Measurement(Feature(fit.s, covariance, fit.axis)), None
    return Measurement(None, doubt), None


def _limb(
    image: GreyImage, intrinsics: Intrinsics, fit: EdgeFit, learnt: FloatArray | None
) -> LimbFit | None:
    if fit.axis is None:
        return refine_sphere(image, intrinsics, fit.s, learnt)
    return refine_cylinder(image, intrinsics, fit.s, fit.axis, learnt)


def _limb_doubt(limb: LimbFit | None, camera: FloatArray, fit: EdgeFit) -> str:
    """Why a refinement is not to be trusted; "" if it is."""
    if limb is None:
        return "the outline's pixels fit no edge"
    if limb.usable_fraction < _LEAST_USABLE:
        return f"only {limb.usable_fraction:.0%} of the outline's pixels fit a target's edge"
    if limb.chi2 > _MOST_CHI2:
        return "the outline's pixels depart from a target's edge"
    for edges, shift_px in zip(fit.outlines, _shifts_px(limb, camera, fit), strict=True):
        if not shift_px <= _MOST_SHIFT_PX + _MOST_SHIFT_PER_EXPECTED * edges.expected_px:
            return "the outline's edges and pixels disagree on where it is"
    return ""


def _shifts_px(limb: LimbFit | None, camera: FloatArray, fit: EdgeFit) -> list[float]:
    """How far each of the fitted outlines lies from its refinement, at most; 0 without one."""
    if limb is None:
        return [0.0 for _ in fit.outlines]
    if limb.axis is None:
        return [cone_shift_px(camera, fit.outlines[0].normals, limb.s)]
    sides = zip(fit.outlines, lines_of_cylinder(limb.s, limb.axis), strict=True)
    return [line_shift_px(camera, edges.normals, n) for edges, n in sides]


@jit
def _grid_covariance(
    s: FloatArray, axis: FloatArray, one: FloatArray, other: FloatArray, focal_px: float
) -> FloatArray:
    """What is added (3, 3) where a side, of normals ``one`` or ``other``, is along the pixel grid.

    There one column of pixels shows the whole edge at one phase, and what the profile is off at
    that phase does not average out, as it does once the side crosses a few columns.
    """
    n1, n2 = lines_of_cylinder(s, axis)
    spread = np.empty((2, 3, 3))
    for side in range(2):
        n, normals = (n1, one) if side == 0 else (n2, other)
        # A line's normals come in order along it.
        wide, high = normals[-1, 0] - normals[0, 0], normals[-1, 1] - normals[0, 1]
        angle = _GRID_PX / (1.0 + min(abs(wide), abs(high)) ** 2) / focal_px
        across = angle * cross(axis, n)
        for i in range(3):
            for j in range(3):
                spread[side, i, j] = across[i] * across[j]
    return cylinder_covariance(n1, n2, spread[0], spread[1])


def _edge_covariance(fit: EdgeFit, focal_px: float, systematic_px: float) -> FloatArray:
    """The edges' covariance (3, 3) with what shading and blur may have moved them by."""
    angle = systematic_px / focal_px
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
