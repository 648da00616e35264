"""The iteration that finds outline, blur, photometry and noise together (compiled)."""

import numpy as np
from numpy.typing import NDArray

from estimator.image.cone import moved, outline_frame
from estimator.image.edges_camera import GreyImage
from estimator.image.intrinsics import FloatArray
from estimator.image.limb_blur import (
    BLUR_START,
    BLUR_START_CYLINDER,
    diagonalised,
    first_blur,
)
from estimator.image.limb_clutter import predict_clutter
from estimator.image.limb_edge import ALL_ROWS, BLUR, MOST_PIXELS, PHOTOMETRY
from estimator.image.limb_locate import locate
from estimator.image.limb_noise import learn_ridge, learn_shading, noise_levels
from estimator.image.limb_normal import STATS, accumulate
from estimator.image.limb_parts import reach_px
from estimator.image.limb_pixels import thinned
from estimator.image.limb_shade import predict_shading
from estimator.image.limb_step import (
    back_substitute,
    covariances,
    next_step,
    shorten,
    step_in_deviations,
    step_rad,
)
from estimator.jit import jit

# What an image tells about the next one: the blur, the turn of its axes, the two noise levels.
KNOWN = BLUR + 3
_HEAVY_TAIL = 30.0
# Texture is correlated: its variance counts twice. Not along a cylinder's long sectors, where once
# gave the smaller error on textures of 2 to 8 px.
_TEXTURE_WEIGHT_SPHERE, _TEXTURE_WEIGHT_CYLINDER = 2.0, 1.0
# The steps: geometry alone, then blur as well on a part of the pixels, then everything on all. The
# photometry's spread is learnt in the first of these only: the slow rest of it brings nothing.
_GEOMETRY_STEPS, _COARSE_STEPS, _LEARNING_STEPS, _ALL_STEPS = 1, 3, 2, 9
_SHADING_STEPS = 5  # the first of these is left out: it finds the blur
# The last step is this small, or this small a part of the standard deviation: each is about a
# fifth of the one before it.
_CONVERGED_RAD, _CONVERGED_DEVIATIONS = 1e-5, 0.7
_CLUTTER_MARGIN_PX = 0.5  # what the outline may be off where clutter is predicted
_LEAST_TEXTURE = 1e-3
_NO_SLOPE = 100.0  # inverse variance of what a prediction leaves of the background's slope
_NARROW_Q = 0.3  # the shape of a point spread narrower than this (sigma of 0.22 px) does not show
_COARSE_STRIDE, _COARSE_MARGIN_PX, _FINE_MARGIN_PX = 4, 1.2, 0.3
# Inverse prior variances of the photometry. Slopes and limb terms start stiff: they could stand
# in for a blur not yet found. Then they are free, for their true spread to be learnt.
_STIFF = np.array([1e-6, 1e-2, 1.0, 1e-6, 1e-2, 1.0, 1.0])
_FREE = np.array([1e-6, 1 / 400.0, 1 / 16.0, 1e-6, 1 / 400.0, 1 / 16.0, 1 / 400.0])


@jit
def solve_outline(
    image: GreyImage, camera: FloatArray, pixels: FloatArray, starts: NDArray[np.int64],
    s: FloatArray, a: FloatArray, sector_px: int, known: FloatArray,
) -> tuple[
    FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray,
    FloatArray, FloatArray, FloatArray,
]:  # fmt: skip
    """Refine (s, a) on the pixels collected from ``image``; a is zero for a sphere.

    ``known`` (KNOWN,) is what an image just before told of blur and noise, which saves the steps
    that look for them; empty if there is none.

    Returns s, a, blur (BLUR,), photometry (sectors, PHOTOMETRY), the sectors' statistics (sectors,
    STATS), noise (sectors, 2), the covariances of s (3, 3) from the model and from the scatter of
    the sectors' scores, how far the last step went (2,) in rad and in standard deviations, and what
    is now known. s is NaN when the equations had no solution.
    """
    geometry = 3 + int(np.any(a != 0.0))
    sectors, n = starts.shape[0] - 1, geometry + BLUR
    information, score = np.zeros((sectors, n, n)), np.zeros((sectors, n))
    back, spread = np.zeros((sectors, PHOTOMETRY, n + 1)), np.zeros((sectors, PHOTOMETRY))
    stats, photometry = np.zeros((sectors, STATS)), np.zeros((sectors, PHOTOMETRY))
    noise = np.empty((sectors, 2))
    noise[:, 0], noise[:, 1] = 9.0, 100.0
    texture_weight = _TEXTURE_WEIGHT_SPHERE if geometry == 3 else _TEXTURE_WEIGHT_CYLINDER
    blur, turn_rad = first_blur(s, a, geometry)
    ridge = _STIFF.copy()
    if known.shape[0] > 0:
        turn_rad = known[BLUR] if geometry == 3 else turn_rad
        blur, noise[:, 0], noise[:, 1] = known[:BLUR].copy(), known[BLUR + 1], known[BLUR + 2]
    total, step, frame = np.eye(n), np.zeros(n), outline_frame(s, a)
    s_there, a_there, moved_by = s, a, np.zeros(geometry)
    work = np.zeros((3, ALL_ROWS * MOST_PIXELS))
    mean, texture = np.zeros((sectors, PHOTOMETRY)), 0.0  # positive where clutter is predicted
    shaded, last, shortened = False, np.zeros(2), 1.0
    used, used_starts = thinned(pixels, starts, _COARSE_STRIDE)
    locate(used, s, a, frame)
    index = -2
    while index < _ALL_STEPS - 1:
        index = _COARSE_STEPS if index == -1 and known.shape[0] > 0 else index + 1
        fine = index >= _COARSE_STEPS
        settled = index > _COARSE_STEPS or (fine and known.shape[0] == 0)
        # At first a wide edge stands for a wrong guess, not for a lens.
        smooth = blur[0] > _NARROW_Q and (index >= _GEOMETRY_STEPS or known.shape[0] > 0)
        accumulate(
            used, used_starts, moved_by, blur, turn_rad, photometry,
            noise, ridge, mean, texture > 0.0, 0.0 if index < 0 else _HEAVY_TAIL,
            _FINE_MARGIN_PX if settled else _COARSE_MARGIN_PX, smooth,
            information, score, back, spread, stats, work,
        )  # fmt: skip
        if index >= 0:
            before = step
            total, step = next_step(information, score, blur, geometry, index < _GEOMETRY_STEPS)
            before *= int(index > _COARSE_STEPS)
            shortened = shorten(total, before, step, shortened)
            last[0], last[1] = step_rad(step, s), step_in_deviations(total, step, geometry)
            moved_by += step[:geometry]
            s, a = moved(s_there, a_there, frame, moved_by)
            blur += step[geometry:]
            turn_rad = diagonalised(blur, turn_rad, geometry == 3)
            noise_levels(stats, noise, texture_weight * (texture == 0.0))
        # A NaN anywhere arrives here: s then fails the comparison.
        if not s[0] ** 2 + s[1] ** 2 + s[2] ** 2 > 1.0 + 1e-9:
            s = s * np.nan
            break
        back_substitute(back, step, photometry)
        if index == _GEOMETRY_STEPS - 1:
            blur[:] = BLUR_START if geometry == 3 else BLUR_START_CYLINDER
        all_next = index == _COARSE_STEPS - 1 or (index < 0 and known.shape[0] > 0)
        if all_next:
            ridge = _FREE.copy()
            used, used_starts = pixels, starts
        if index == _GEOMETRY_STEPS - 1 or all_next:
            s_there, a_there, frame, moved_by = s, a, outline_frame(s, a), np.zeros(geometry)
            locate(used, s, a, frame)
            if all_next and geometry == 4:
                texture = _foresee(image, used, starts, sector_px, blur, noise, ridge, mean)
                shaded = predict_shading(
                    image, camera, used, starts, s, a, blur, turn_rad,
                    reach_px(blur, _CLUTTER_MARGIN_PX, blur[0] > _NARROW_Q),
                )  # fmt: skip
        _learn(
            photometry, spread, stats, ridge, mean, index - _COARSE_STEPS, geometry == 4,
            texture > 0.0, shaded,
        )  # fmt: skip
        small = last[0] < _CONVERGED_RAD or last[1] < _CONVERGED_DEVIATIONS
        if index >= _COARSE_STEPS + _LEARNING_STEPS - 1 and small:
            break
    model, scatter = covariances(total, information, score, frame, s)
    learnt = np.empty(KNOWN)
    learnt[:BLUR], learnt[BLUR] = blur, turn_rad
    learnt[BLUR + 1], learnt[BLUR + 2] = noise[0, 0], np.mean(noise[:, 1]) + texture
    return s, a, blur, photometry, stats, noise, model, scatter, last, learnt


@jit
def _foresee(
    image: GreyImage, pixels: FloatArray, starts: NDArray[np.int64], sector_px: int,
    blur: FloatArray, noise: FloatArray, ridge: FloatArray, mean: FloatArray,
) -> float:  # fmt: skip
    """Predict clutter if there is some; the variance known so far, which this replaces, or 0."""
    reach = reach_px(blur, _CLUTTER_MARGIN_PX, blur[0] > _NARROW_Q)
    if not predict_clutter(image, pixels, starts, sector_px, reach, noise[0, 0], mean):
        return 0.0
    texture = max(float(np.mean(noise[:, 1])), _LEAST_TEXTURE)
    noise[:, 1], ridge[2] = 0.0, _NO_SLOPE
    return texture


@jit
def _learn(
    photometry: FloatArray, spread: FloatArray, stats: FloatArray, ridge: FloatArray,
    mean: FloatArray, age: int, cylinder: bool, predicted: bool, shaded: bool,
) -> None:  # fmt: skip
    """What to expect of the photometry, ``age`` steps after all pixels came in."""
    if cylinder and 1 <= age < _SHADING_STEPS:
        learn_shading(photometry, spread, stats, mean)
    if 0 <= age < _LEARNING_STEPS:
        learn_ridge(photometry, spread, stats, ridge, mean, age == 0, cylinder, predicted, shaded)
