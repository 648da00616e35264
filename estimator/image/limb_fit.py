"""Maximum-likelihood refinement of an outline on the intensities of the pixels around it.

The model of a pixel is limb_normal's, its solution limb_solve's; here the result is turned into a
measurement with an honest covariance and with everything needed to decide whether to trust it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.image.limb_normal import (
    CHI_EDGE,
    N_EDGE,
    SHIFT,
    SHIFT_INFO,
)
from estimator.image.limb_pixels import collect
from estimator.image.limb_solve import solve_outline, step_rad

GreyImage = NDArray[np.uint8]

_BAND_PX = 6.0
_SPHERE_SECTOR_PX, _CYLINDER_SECTOR_PX = 12.0, 22.0
_CONVERGED_PX = 0.02
# A sector is usable when its contrast stands out of the noise, it alone would put the edge near
# where the others do, and its residuals across the edge are about as large as they should be.
_LEAST_CONTRAST_GREY, _LEAST_CONTRAST_SD = 6.0, 2.0
_MOST_SHIFT_PX, _MOST_SHIFT_SD, _MOST_SHIFT_STD_PX, _MOST_CHI2 = 0.5, 4.0, 0.5, 6.0


@dataclass(frozen=True, slots=True)
class LimbSectors:
    """What each short piece of the outline says: arrays over the n sectors that are in view."""

    centre_px: FloatArray  # (n, 2) u, v on the fitted outline
    contrast_grey: FloatArray  # (n,) inner minus outer level at the edge
    shift_px: FloatArray  # (n,) where this sector alone would put the edge, positive outwards
    shift_std_px: FloatArray  # (n,)
    chi2: FloatArray  # (n,) mean squared residual across the edge over its expected variance
    usable: NDArray[np.bool_]  # (n,) shows the modelled edge at the modelled place


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
    usable_fraction: float  # of the sectors that are in view
    in_view_fraction: float  # of all sectors (a cylinder's lines are cut at the image's border)
    sectors: LimbSectors


def refine_sphere(image: GreyImage, intrinsics: Intrinsics, s0: FloatArray) -> LimbFit | None:
    """The sphere whose outline explains ``image`` best, near that of s0 (3,).

    The guess' outline may be wrong by about 2 px. None when there is nothing to fit: s0 inside the
    target or behind the camera, too little of the outline in view, or equations without solution.
    """
    return _refine(image, intrinsics, np.array(s0, dtype=float), None)


def refine_cylinder(
    image: GreyImage, intrinsics: Intrinsics, s0: FloatArray, axis0: FloatArray
) -> LimbFit | None:
    """The cylinder whose outline explains ``image`` best, near that of s0 (3,) and ``axis0`` (3,).

    As `refine_sphere`. The returned axis is unit, normal to s, and points as ``axis0`` does.
    """
    axis = np.array(axis0, dtype=float)
    axis /= np.linalg.norm(axis)
    s = np.array(s0, dtype=float)
    return _refine(image, intrinsics, s - axis * float(axis @ s), axis)


def _refine(
    image: GreyImage, intrinsics: Intrinsics, s0: FloatArray, axis0: FloatArray | None
) -> LimbFit | None:
    a = np.zeros(3) if axis0 is None else axis0
    if not (np.all(np.isfinite(s0)) and np.all(np.isfinite(a)) and s0 @ s0 > 1.0 and s0[2] > 0.0):
        return None
    camera = np.array(
        [
            *(intrinsics.fx_px, intrinsics.fy_px, intrinsics.cx_px, intrinsics.cy_px),
            *intrinsics.distortion,
        ]
    )
    sector_px = _SPHERE_SECTOR_PX if axis0 is None else _CYLINDER_SECTOR_PX
    pixels, starts = collect(image, camera, s0, a, _BAND_PX, _BAND_PX, sector_px)
    counts = np.diff(starts)
    in_view = counts > 0.4 * max(float(np.median(counts[counts > 0])), 1.0) if starts[-1] else None
    if in_view is None or np.count_nonzero(in_view) < 6:
        return None
    geometry = 3 if axis0 is None else 4
    s, axis, blur, photometry, stats, noise, model, scatter, step = solve_outline(
        pixels, starts, s0, a, geometry
    )
    if not (np.all(np.isfinite(s)) and np.all(np.isfinite(scatter))):
        return None
    sectors = _sectors(photometry, stats, noise, starts, pixels, intrinsics, in_view)
    edge_count = max(float(stats[:, N_EDGE].sum()), 1.0)
    return LimbFit(
        s=s,
        covariance=_honest(model, scatter),
        axis=None if axis0 is None else axis,
        converged=bool(intrinsics.fx_px * step_rad(step, s) < _CONVERGED_PX),
        blur_px=float(np.sqrt(blur[1])),
        psf_sigma_px=float(np.sqrt(blur[0] / 6.0)),
        noise_grey=float(np.sqrt(noise[0, 0])),
        chi2=float(stats[:, CHI_EDGE].sum()) / edge_count,
        usable_fraction=float(np.mean(sectors.usable)),
        in_view_fraction=float(np.mean(in_view)),
        sectors=sectors,
    )


def _honest(model: FloatArray, scatter: FloatArray) -> FloatArray:
    """The larger of the two covariances, by their traces."""
    return scatter if np.trace(scatter) > np.trace(model) else model


def _sectors(
    photometry: FloatArray, stats: FloatArray, noise: FloatArray, starts: NDArray[np.int64],
    pixels: FloatArray, intrinsics: Intrinsics, in_view: NDArray[np.bool_],
) -> LimbSectors:  # fmt: skip
    """The sectors in view with their verdicts."""
    contrast = (photometry[:, 3] - photometry[:, 0])[in_view]
    shift = -stats[in_view, SHIFT]
    shift_std = 1.0 / np.sqrt(np.maximum(stats[in_view, SHIFT_INFO], 1e-12))
    chi2 = stats[in_view, CHI_EDGE] / np.maximum(stats[in_view, N_EDGE], 1.0)
    sums = np.add.reduceat(pixels[:2], np.minimum(starts[:-1], starts[-1] - 1), axis=1)
    centres = intrinsics.project(sums.T[in_view] / np.diff(starts)[in_view, None])
    sign = 1.0 if np.median(contrast) > 0.0 else -1.0
    least = max(_LEAST_CONTRAST_GREY, _LEAST_CONTRAST_SD * float(np.sqrt(noise[0, 0])))
    usable = (
        (sign * contrast > least)
        & (np.abs(shift) < _MOST_SHIFT_PX + _MOST_SHIFT_SD * np.minimum(shift_std, 0.2))
        & (shift_std < _MOST_SHIFT_STD_PX)
        & (chi2 < _MOST_CHI2)
        & (stats[in_view, N_EDGE] > 0.0)
    )
    return LimbSectors(centres, contrast, shift, shift_std, chi2, usable)
