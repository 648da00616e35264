"""What light does to a cylinder's last pixels is read off its body, and no shadow is invented."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.image.cone import outline_frame
from estimator.image.edges_camera import pack_camera
from estimator.image.limb_fit import refine_cylinder
from estimator.image.limb_locate import locate
from estimator.image.limb_pixels import DISTANCE, SHADE, SHADE_SLOPE, U, V, collect
from estimator.image.limb_shade import predict_shading
from tests.estimator.image.exact_images import (
    DEFAULT_INTRINSICS,
    FloatArray,
    GreyImage,
    Look,
    cylinder_s,
    render,
    render_exact,
)

AXIS = np.array([0.6, 0.8, 0.0])
S = cylinder_s(np.array([0.2, -0.1, 10.0]), AXIS)
# From the outline's first side to the second, and towards the camera.
ACROSS = np.cross(S, AXIS) / np.linalg.norm(S)
TOWARDS = -S / np.linalg.norm(S)
SHARP = np.zeros(6)


def lit_from(degrees: float, wrapped: bool = False) -> Look:
    """Light at an angle from the camera's direction; from 90 on one side lies in shadow."""
    angle = np.radians(degrees)
    light = np.cos(angle) * TOWARDS + np.sin(angle) * ACROSS
    return Look(background=40.0, light=light, wrapped_light=wrapped)


def predicted(image: GreyImage) -> tuple[FloatArray, int] | None:
    """Pixels (ROWS, n) of the cylinder with their shading, and where the second side's begin."""
    camera = pack_camera(DEFAULT_INTRINSICS)
    pixels, starts = collect(image, camera, S, AXIS, 6.0, 6.0, 22.0)
    locate(pixels, S, AXIS, outline_frame(S, AXIS))
    known = predict_shading(image, camera, pixels, starts, S, AXIS, SHARP, 0.0, 1.5)
    return (pixels, int(starts[len(starts) // 2])) if known else None


@pytest.mark.parametrize("degrees", [0.0, 40.0, 90.0, 100.0, 105.0, 150.0])
@pytest.mark.parametrize("wrapped", [False, True])
def test_the_shading_before_an_outline_is_foretold(degrees: float, wrapped: bool) -> None:
    look = lit_from(degrees, wrapped)
    found = predicted(render(S, AXIS, look, np.random.default_rng(1)))
    assert found is not None
    pixels, second = found
    distance = pixels[DISTANCE]
    exact = render_exact(S, AXIS, look)[pixels[V].astype(int), pixels[U].astype(int)]
    shade = pixels[SHADE] + pixels[SHADE_SLOPE] * distance
    # From 1 px on the pixels show the surface alone, above their side's level at the outline.
    for side in (slice(None, second), slice(second, None)):
        left = (exact - shade)[side][distance[side] > 1.0]
        assert np.max(np.abs(left - np.median(left))) < 2.0


def test_a_flat_grey_body_foretells_nothing() -> None:
    for seed in range(6):
        assert predicted(render(S, AXIS, Look(), np.random.default_rng(seed))) is None


def test_a_body_that_is_hardly_in_view_foretells_nothing() -> None:
    s = cylinder_s(np.array([6.6, 0.0, 8.0]), np.array([0.0, 1.0, 0.0]))
    image = render(s, np.array([0.0, 1.0, 0.0]), Look(), np.random.default_rng(3))
    camera = pack_camera(DEFAULT_INTRINSICS)
    axis = np.array([0.0, 1.0, 0.0])
    pixels, starts = collect(image, camera, s, axis, 6.0, 6.0, 22.0)
    locate(pixels, s, axis, outline_frame(s, axis))
    assert not predict_shading(image, camera, pixels, starts, s, axis, SHARP, 0.0, 1.5)
    assert not np.any(pixels[SHADE]) and not np.any(pixels[SHADE_SLOPE])


def test_a_shadow_that_begins_beside_the_outline_moves_it_little() -> None:
    relative = []
    for degrees in (96.0, 99.0, 102.0, 105.0):
        blur = 3.0 * ACROSS[:2] / np.linalg.norm(ACROSS[:2])
        look = replace(lit_from(degrees), blur_px=(float(blur[0]), float(blur[1])))
        for seed in (1, 2):
            image = render(S, AXIS, look, np.random.default_rng(seed))
            fit = refine_cylinder(image, DEFAULT_INTRINSICS, S, AXIS)
            assert fit is not None
            relative.append(float(np.linalg.norm(fit.s) / np.linalg.norm(S)) - 1.0)
    # 1e-4 of |s| is 0.016 px at one of the two sides.
    assert abs(float(np.mean(relative))) < 5e-5
    assert np.max(np.abs(relative)) < 1.2e-4
