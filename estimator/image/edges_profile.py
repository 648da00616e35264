"""Sub-pixel edge candidates along the normals of a predicted outline (compiled)."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.edges_camera import GreyImage, bilinear, normalised_of
from estimator.image.intrinsics import FloatArray
from estimator.jit import jit

BoolArray = NDArray[np.bool_]

MAX_PEAKS = 4
# Antisymmetric smoothing derivative: a step of h grey levels answers with h at its place.
_W1, _W2, _W3 = 0.5, 0.35, 0.15
_TAP = 3
# Samples beyond the blurred edge itself, for what to expect of it.
_NOISE_FROM_PX, _NOISE_SAMPLES = 3.0, 5
_NOISE_LEAST_STEP_GREY, NOISE_MOST_PX = 5.0, 0.5


@jit
def edge_peaks(
    image: GreyImage, normals: FloatArray, reach_px: int, sign: float, least_grey: float
) -> tuple[FloatArray, FloatArray]:
    """Offsets and strengths, each (n, MAX_PEAKS), of the edges met along each normal.

    ``sign`` is +1 for a target brighter than what surrounds it, -1 for a darker one. Offsets in
    px along the outward normal; strengths in grey levels, strongest first, 0 where there is none.
    """
    count = normals.shape[0]
    size = 2 * (reach_px + _TAP) + 1
    profile = np.empty(size)
    slope = np.zeros(size)
    offsets = np.zeros((count, MAX_PEAKS))
    strengths = np.zeros((count, MAX_PEAKS))
    for i in range(count):
        u, v, nu, nv = normals[i, 0], normals[i, 1], normals[i, 2], normals[i, 3]
        for k in range(size):
            d = k - reach_px - _TAP
            profile[k] = bilinear(image, u + d * nu, v + d * nv)
        for k in range(_TAP, size - _TAP):
            slope[k] = sign * (
                _W1 * (profile[k - 1] - profile[k + 1])
                + _W2 * (profile[k - 2] - profile[k + 2])
                + _W3 * (profile[k - 3] - profile[k + 3])
            )
        for k in range(_TAP + 1, size - _TAP - 1):
            here, before, after = slope[k], slope[k - 1], slope[k + 1]
            # Comparisons with NaN (outside the image) are false, so such places are skipped.
            if here > least_grey and here >= before and here > after:
                curvature = before - 2.0 * here + after
                shift = 0.5 * (before - after) / curvature if curvature < 0.0 else 0.0
                _insert(offsets[i], strengths[i], k - reach_px - _TAP + shift, here)
    return offsets, strengths


@jit
def _insert(offsets: FloatArray, strengths: FloatArray, offset: float, strength: float) -> None:
    """Keep the strongest peaks, strongest first."""
    place = MAX_PEAKS
    while place > 0 and strengths[place - 1] < strength:
        place -= 1
    if place == MAX_PEAKS:
        return
    for k in range(MAX_PEAKS - 1, place, -1):
        offsets[k] = offsets[k - 1]
        strengths[k] = strengths[k - 1]
    offsets[place] = offset
    strengths[place] = strength


@jit
def peak_rays(
    camera: FloatArray, normals: FloatArray, offsets: FloatArray, strengths: FloatArray
) -> FloatArray:
    """Unit rays (n, MAX_PEAKS, 3) of the edge candidates; zero where there is none."""
    rays = np.zeros((normals.shape[0], MAX_PEAKS, 3))
    for i in range(normals.shape[0]):
        for k in range(MAX_PEAKS):
            if strengths[i, k] <= 0.0:
                break
            u = normals[i, 0] + offsets[i, k] * normals[i, 2]
            v = normals[i, 1] + offsets[i, k] * normals[i, 3]
            x, y = normalised_of(camera, u, v)
            norm = np.sqrt(x * x + y * y + 1.0)
            rays[i, k, 0], rays[i, k, 1], rays[i, k, 2] = x / norm, y / norm, 1.0 / norm
    return rays


@jit
def expected_noise_px(image: GreyImage, normals: FloatArray, sign: float) -> FloatArray:
    """Scatter to expect of each edge point (n,), from what the image looks like around it.

    The grey that varies along each normal on either side of the edge, over the step between the
    sides; inside, shading that changes steadily does not count. NOISE_MOST_PX means that no step
    of the right sign stands out.
    """
    noise = np.full(normals.shape[0], NOISE_MOST_PX)
    for i in range(normals.shape[0]):
        u, v, nu, nv = normals[i, 0], normals[i, 1], normals[i, 2], normals[i, 3]
        mean_in, mean_out, square_in, square_out, tilt_in = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(_NOISE_SAMPLES):
            d = _NOISE_FROM_PX + k
            inner = bilinear(image, u - d * nu, v - d * nv)
            outer = bilinear(image, u + d * nu, v + d * nv)
            mean_in += inner / _NOISE_SAMPLES
            mean_out += outer / _NOISE_SAMPLES
            square_in += inner * inner / _NOISE_SAMPLES
            square_out += outer * outer / _NOISE_SAMPLES
            tilt_in += inner * (k - 2.0) / 10.0
        out = max(square_out - mean_out * mean_out, 0.0) * 5.0 / 4.0
        inside = max(square_in - mean_in * mean_in - 2.0 * tilt_in * tilt_in, 0.0) * 5.0 / 3.0
        step = max(sign * (mean_in - mean_out), _NOISE_LEAST_STEP_GREY)
        if step > _NOISE_LEAST_STEP_GREY:  # false for NaN, outside the image
            noise[i] = min(np.sqrt(out + inside) / step, NOISE_MOST_PX)
    return noise


@jit
def stands_out_deep(
    image: GreyImage, normals: FloatArray, sign: float, depth_px: float
) -> BoolArray:
    """Where (n,) the target also differs from its surroundings ``depth_px`` inside its outline.

    A thin stripe along the outline, or another thing's edge, has something else behind it.
    """
    deep = np.zeros(normals.shape[0], np.bool_)
    for i in range(normals.shape[0]):
        u, v, nu, nv = normals[i, 0], normals[i, 1], normals[i, 2], normals[i, 3]
        near, far, outer = 0.0, 0.0, 0.0
        for k in range(3):
            d = _NOISE_FROM_PX + k
            near += sign * bilinear(image, u - d * nu, v - d * nv) / 3.0
            outer += sign * bilinear(image, u + d * nu, v + d * nv) / 3.0
            d = depth_px - 1.0 + k
            far += sign * bilinear(image, u - d * nu, v - d * nv) / 3.0
        # A shaded target's inside may be darker than its rim, but not like what is outside.
        deep[i] = far - outer > 0.25 * (near - outer)
    return deep
