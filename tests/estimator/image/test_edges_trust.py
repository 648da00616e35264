"""How much a side's edges may scatter depends on how blurred the side is."""

from dataclasses import replace

import numpy as np

from estimator.image.edges_camera import pack_camera
from estimator.image.edges_fit import fit_cylinder_edges
from estimator.image.edges_trust import cylinder_doubt
from estimator.image.feature import Feature
from estimator.image.tracker import TargetTracker
from tests.estimator.image.exact_images import (
    DEFAULT_INTRINSICS,
    FloatArray,
    GreyImage,
    cylinder_s,
    hard_look,
    render,
    texture,
)

AXIS = np.array([0.6, 0.8, 0.0])
S = cylinder_s(np.array([0.2, -0.1, 10.0]), AXIS)
ACROSS = np.array([0.8, -0.6])
MOTION_PX = 3.6


def dim_and_blurred(seed: int) -> GreyImage:
    """A cylinder whose unlit side, hardly brighter than its clutter, moved across itself."""
    rng = np.random.default_rng(seed)
    look = replace(
        hard_look(rng),
        background=texture(rng, 2.5),
        light=np.array([0.8, -0.6, -0.4]),
        blur_px=(MOTION_PX * float(ACROSS[0]), MOTION_PX * float(ACROSS[1])),
    )
    return render(S, AXIS, look, rng)


def jagged(seed: int) -> GreyImage:
    """A sharp pipe whose sides jump to and fro by about a pixel."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[:480, :640]
    du, dv = u - 319.5 - 800.0 * S[0] / S[2], v - 239.5 - 800.0 * S[1] / S[2]
    off = ACROSS[0] * du + ACROSS[1] * dv
    along = np.clip((ACROSS[1] * du - ACROSS[0] * dv) / 5.0 + 80.0, 0, 159)
    half: FloatArray = 80.0 + rng.choice([-1.0, 1.0], 160)[along.astype(int)]
    share = np.clip(half + 0.5 - np.abs(off), 0.0, 1.0)
    noise = 2.0 * rng.standard_normal(share.shape)
    image: GreyImage = np.clip(np.rint(25.0 + 190.0 * share + noise), 0, 255).astype(np.uint8)
    return image


def test_a_blurred_dim_side_is_no_crooked_one() -> None:
    camera = pack_camera(DEFAULT_INTRINSICS)
    doubted = 0
    for seed in range(10):
        image = dim_and_blurred(seed)
        fit = fit_cylinder_edges(image, camera, S, AXIS, 1.0)
        assert fit is not None
        doubted += "scatter" in cylinder_doubt(fit)
        assert cylinder_doubt(fit, MOTION_PX**2 / 12.0) == ""
        near = Feature(S, np.eye(3), AXIS)
        feature = TargetTracker("cylinder", DEFAULT_INTRINSICS).measure(image, near).feature
        assert feature is not None
        assert abs(float(np.linalg.norm(feature.s) / np.linalg.norm(S)) - 1.0) < 2e-3
    assert doubted >= 2  # or this would say nothing about the blur


def test_a_sharp_crooked_side_is_refused() -> None:
    for seed in range(3):
        image = jagged(seed)
        near = Feature(S, np.eye(3), AXIS)
        measurement = TargetTracker("cylinder", DEFAULT_INTRINSICS).measure(image, near)
        assert not measurement.found
        assert "scatter" in measurement.reason
