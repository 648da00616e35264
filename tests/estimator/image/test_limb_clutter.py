"""Clutter under the blurred edge is told from the clutter beside it; a calm background is not."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.image.cone import outline_frame
from estimator.image.edges_camera import pack_camera
from estimator.image.limb_clutter import predict_clutter
from estimator.image.limb_edge import PHOTOMETRY
from estimator.image.limb_fit import refine_cylinder
from estimator.image.limb_locate import locate
from estimator.image.limb_pixels import CLUTTER, CLUTTER_VARIANCE, DISTANCE, U, V, collect
from tests.estimator.image.exact_images import (
    DEFAULT_INTRINSICS,
    FloatArray,
    Look,
    blocks,
    cylinder_s,
    hard_look,
    render,
    texture,
)

AXIS = np.array([0.6, 0.8, 0.0])
S = cylinder_s(np.array([0.2, -0.1, 10.0]), AXIS)
SECTOR_PX, REACH_PX = 22, 2.8


def predicted(
    background: float | FloatArray,
) -> tuple[FloatArray, NDArray[np.int64], FloatArray] | None:
    """Located pixels (ROWS, n), their sectors (n,) and the sectors' levels of ``background``."""
    rng = np.random.default_rng(5)
    look = replace(hard_look(rng), background=background)
    image = render(S, AXIS, look, rng)
    camera = pack_camera(DEFAULT_INTRINSICS)
    pixels, starts = collect(image, camera, S, AXIS, 6.0, 4.5, float(SECTOR_PX))
    locate(pixels, S, AXIS, outline_frame(S, AXIS))
    mean = np.zeros((len(starts) - 1, PHOTOMETRY))
    read = look.noise_grey**2
    seen = predict_clutter(image, pixels, starts, SECTOR_PX, REACH_PX, read, mean)
    sectors = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    return (pixels, sectors, mean[:, 0]) if seen else None


def about_means(values: FloatArray, groups: NDArray[np.int64]) -> FloatArray:
    """``values`` (n,) less the mean of their group (n,)."""
    sums = np.bincount(groups, values)
    result: FloatArray = values - (sums / np.maximum(np.bincount(groups), 1))[groups]
    return result


@pytest.mark.parametrize("correlation_px", [2.5, 4.0, 8.0])
def test_what_lies_under_the_edge_is_told_from_what_lies_beside_it(correlation_px: float) -> None:
    background = texture(np.random.default_rng(1), correlation_px)
    found = predicted(background)
    assert found is not None
    pixels, sectors, levels = found
    # Where the outline is, REACH_PX deep. Each sector's mean is left open.
    at = np.abs(pixels[DISTANCE]) < 0.5
    truth = background[pixels[V, at].astype(int), pixels[U, at].astype(int)]
    left = about_means(truth - pixels[CLUTTER, at], sectors[at])
    alone = about_means(truth, sectors[at])
    assert np.std(left) < 0.75 * np.std(alone)
    assert np.mean(pixels[CLUTTER_VARIANCE, at]) < 0.5 * np.var(truth)
    whole = levels[sectors[at]] + pixels[CLUTTER, at]
    assert np.std(truth - whole) < 0.75 * np.std(truth)
    assert abs(np.mean(truth - whole)) < 0.2 * np.std(truth)


@pytest.mark.parametrize("background", [20.0, 57.0])
def test_a_calm_background_is_left_to_the_sectors(background: float) -> None:
    assert predicted(background) is None


def test_a_slow_change_of_the_background_is_no_clutter() -> None:
    ramp = np.tile(np.linspace(10.0, 100.0, 640), (480, 1))
    assert predicted(ramp) is None


def test_edgy_clutter_beside_the_sides_is_survived() -> None:
    worst = 0.0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        look = replace(hard_look(rng), background=blocks(rng))
        fit = refine_cylinder(render(S, AXIS, look, rng), DEFAULT_INTRINSICS, S, AXIS)
        assert fit is not None
        worst = max(worst, abs(float(np.linalg.norm(fit.s) / np.linalg.norm(S)) - 1.0))
    assert worst < 2e-3


def test_a_calm_picture_is_measured_as_well_as_ever() -> None:
    rng = np.random.default_rng(9)
    relative = []
    for _ in range(6):
        fit = refine_cylinder(render(S, AXIS, Look(), rng), DEFAULT_INTRINSICS, S, AXIS)
        assert fit is not None
        relative.append(float(np.linalg.norm(fit.s) / np.linalg.norm(S)) - 1.0)
    assert np.sqrt(np.mean(np.square(relative))) < 2e-5
