"""Maximum-likelihood refinement of an outline on the intensities of the pixels around it.

The model of a pixel is limb_normal's, its solution limb_solve's; here the result is turned into a
measurement with an honest covariance and with everything needed to decide whether to trust it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.image.edges_camera import pack_camera
from estimator.image.edges_cylinder import cross, cylinder_covariance, lines_of_cylinder
from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.image.limb_pixels import CLUTTER, GREY, collect
from estimator.image.limb_solve import solve_outline
from estimator.image.limb_verdict import in_view, verdict

GreyImage = NDArray[np.uint8]

# The band of pixels looked at, to both sides of the outline, and the length of its sectors.
_BAND_PX = 6.0
_SPHERE_SECTOR_PX, _CYLINDER_SECTOR_PX = 12, 22
_CONVERGED_PX, _CONVERGED_DEVIATIONS = 0.02, 1.0  # or so many standard deviations
# An outline's systematic error in px over the squared width of the motion in px: what makes the
# normalised squared errors about 1 on side-lit, moving targets before clutter.
_SHADING_SPHERE, _SHADING_CYLINDER = 0.0006, 0.002
# Where so many pixels of the band are black or white, one of the edge's levels may be a little
# beyond; more than a little shows as scatter.
_CLIPPED_SHARE, _CLIPPED_PX = 0.05, 0.012
_LEAST_SECTORS = 6
_NOTHING = np.empty(0)
# How alike the squared widths of the point spread and of the motion are when they are alike.
_ALIKE_PX2, _ALIKE_SHARE = 0.7, 0.2


@dataclass(frozen=True, slots=True)
class LimbFit:
    """The outline that explains the pixels around it best, and how well it does."""

    s: FloatArray  # (3,)
    covariance: FloatArray  # (3, 3) of s
    axis: FloatArray | None  # (3,), cylinder only
    converged: bool
    blur_px: float  # full width of the motion during the exposure, in its direction
    psf_sigma_px: float
    noise_grey: float  # of reading
    chi2: float  # over the pixels of the edge, about 1 when the model fits
    usable_fraction: float  # of the sectors in view, those that are usable
    in_view: NDArray[np.bool_]  # (n,) of all sectors, not cut away by the image's border
    usable: NDArray[np.bool_]  # (n,) shows the modelled edge at the modelled place
    learnt: FloatArray  # (KNOWN,) of blur and noise, for the image that comes next


def refine_sphere(
    image: GreyImage, intrinsics: Intrinsics, s0: FloatArray, learnt: FloatArray | None = None
) -> LimbFit | None:
    """The sphere whose outline explains ``image`` best, near that of s0 (3,).

    The guess' outline may be wrong by about 2 px; by 0.5 px with ``learnt``, another image's, which
    saves most of the steps if blur and noise are about the same. None when there is nothing to
    fit: s0 inside the target or behind the camera, too little of the outline in view, or equations
    without solution.
    """
    return _refine(image, intrinsics, np.array(s0, dtype=float), None, learnt)


def refine_cylinder(
    image: GreyImage, intrinsics: Intrinsics, s0: FloatArray, axis0: FloatArray,
    learnt: FloatArray | None = None,
) -> LimbFit | None:  # fmt: skip
    """The cylinder whose outline explains ``image`` best, near that of s0 (3,) and ``axis0`` (3,).

    As `refine_sphere`. The returned axis is unit, normal to s, and points as ``axis0`` does.
    """
    axis = np.array(axis0, dtype=float)
    axis /= np.linalg.norm(axis)
    s = np.array(s0, dtype=float)
    return _refine(image, intrinsics, s - axis * float(axis @ s), axis, learnt)


def _refine(
    image: GreyImage, intrinsics: Intrinsics, s0: FloatArray, axis0: FloatArray | None,
    learnt: FloatArray | None,
) -> LimbFit | None:  # fmt: skip
    a = np.zeros(3) if axis0 is None else axis0
    if not (np.all(np.isfinite(s0)) and np.all(np.isfinite(a)) and s0 @ s0 > 1.0 and s0[2] > 0.0):
        return None
    camera = pack_camera(intrinsics)
    sector_px = _SPHERE_SECTOR_PX if axis0 is None else _CYLINDER_SECTOR_PX
    pixels, starts = collect(image, camera, s0, a, _BAND_PX, _BAND_PX, float(sector_px))
    seen = in_view(starts)
    if np.count_nonzero(seen) < _LEAST_SECTORS:
        return None
    known = _NOTHING if learnt is None else learnt
    while True:
        s, axis, blur, photometry, stats, noise, model, scatter, last, now_known = solve_outline(
            image, camera, pixels, starts, s0, a, sector_px, known
        )
        solved = math.isfinite(s.sum()) and math.isfinite(scatter.sum())
        converged = solved and bool(
            intrinsics.fx_px * last[0] < _CONVERGED_PX or last[1] < _CONVERGED_DEVIATIONS
        )
        if len(known) == 0 or (converged and _alike(blur, known, axis0 is None)):
            break
        known = _NOTHING
        pixels[CLUTTER:] = 0.0  # what was predicted with the other image's blur
    if not solved:
        return None
    usable, chi2 = verdict(photometry, stats, noise, seen)
    return LimbFit(
        s=s,
        covariance=_honest(model, scatter)
        + _shift_covariance(s, axis, _light_rad(blur, pixels[GREY], axis0 is None, intrinsics)),
        axis=None if axis0 is None else axis,
        converged=converged,
        blur_px=math.sqrt(blur[1]),
        psf_sigma_px=math.sqrt(blur[0] / 6.0),
        noise_grey=math.sqrt(noise[0, 0]),
        chi2=chi2,
        usable_fraction=np.count_nonzero(usable) / np.count_nonzero(seen),
        in_view=seen,
        usable=usable,
        learnt=now_known,
    )


def blur_variance_px2(learnt: FloatArray) -> float:
    """Variance of the point spread and of the motion across the outline, of `LimbFit.learnt`."""
    return float(learnt[0] / 6.0 + learnt[1] / 12.0)


def _alike(blur: FloatArray, known: FloatArray, sphere: bool) -> bool:
    """Whether the blur found is about the known one, as it must be where few steps were made."""
    return all(
        abs(now - before) < _ALIKE_PX2 + _ALIKE_SHARE * before
        for now, before in zip(_widths(blur, sphere), _widths(known, sphere), strict=True)
    )


def _widths(blur: FloatArray, sphere: bool) -> list[float]:
    """Squared widths of the point spread and of the motion along its axes; of all across a line."""
    return [blur[0], blur[1], blur[4]] if sphere else [2.0 * blur[0] + blur[1] + blur[4] / 3.0]


def _light_rad(blur: FloatArray, grey: FloatArray, sphere: bool, intrinsics: Intrinsics) -> float:
    """What the outline may be off for light that the model does not know (rad).

    Of its change across the outline: motion of width w mixes what lies w about the outline, and
    the part of second order grows with w^2. And of light too weak or too strong for the camera.
    """
    off_px = (_SHADING_SPHERE if sphere else _SHADING_CYLINDER) * (blur[1] + blur[4])
    if max(np.mean(grey <= 0.0), np.mean(grey >= 255.0)) > _CLIPPED_SHARE:
        off_px = math.hypot(off_px, _CLIPPED_PX)
    return float(off_px / intrinsics.fx_px)


def _shift_covariance(s: FloatArray, axis: FloatArray, angle: float) -> FloatArray:
    """Of s (3, 3), for an outline that is off by ``angle``: a sphere's all around, each side of
    a cylinder for itself."""
    norm2 = float(s @ s)
    if not np.any(axis):  # |s| = 1 / sin(theta), and theta is the angle that is wrong
        towards: FloatArray = angle**2 * (norm2 - 1.0) * np.outer(s, s)
        return towards
    one, other = lines_of_cylinder(s, axis)
    spread = [np.outer(t, t) * angle**2 for t in (cross(axis, one), cross(axis, other))]
    return cylinder_covariance(one, other, spread[0], spread[1])


def _honest(model: FloatArray, scatter: FloatArray) -> FloatArray:
    """The larger of the two covariances, by their traces."""
    return scatter if scatter.trace() > model.trace() else model
