"""Detection from scratch: the target is among the first candidates whatever surrounds it."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.image.detect_cylinder import detect_cylinders
from estimator.image.detect_grid import grid_for, make_grid
from estimator.image.detect_sphere import detect_spheres
from estimator.image.edges_camera import pack_camera
from estimator.image.edges_cylinder import lines_of_cylinder
from estimator.image.intrinsics import FloatArray, Intrinsics
from tests.estimator.image.exact_images import (
    DEFAULT_INTRINSICS,
    Look,
    blocks,
    cylinder_s,
    hard_look,
    render,
)

LENS = Intrinsics(800.0, 800.0, 319.5, 239.5, np.array([-0.3, 0.1, 1e-3, 0.0, 0.0]))
SHAPE = (480, 640)


def sphere_at(rng: np.random.Generator, radius_px: float) -> FloatArray:
    z = np.sqrt(1.0 + (800.0 / radius_px) ** 2)
    room = np.maximum(0.0, np.array([310.0, 230.0]) - 1.1 * radius_px) / 800.0
    return np.append(rng.uniform(-room, room) * z, z)


def cylinder_at(rng: np.random.Generator, width_px: float) -> tuple[FloatArray, FloatArray]:
    roll, tilt = rng.uniform(0.0, np.pi), rng.uniform(-0.6, 0.6)
    axis = np.array([np.cos(roll) * np.cos(tilt), np.sin(roll) * np.cos(tilt), np.sin(tilt)])
    across = np.array([-np.sin(roll), np.cos(roll), 0.0])
    across *= rng.uniform(-1.0, 1.0) * max(0.0, 0.25 - 0.6 * width_px / 800.0)
    s = cylinder_s(across + np.array([0.0, 0.0, 1.0]), axis)
    return s / np.linalg.norm(s) * np.sqrt(1.0 + (1600.0 / width_px) ** 2), axis


def sphere_error_px(found: FloatArray, s: FloatArray) -> float:
    away = found / np.linalg.norm(found) - s / np.linalg.norm(s)
    growth = 1.0 / np.linalg.norm(found) - 1.0 / np.linalg.norm(s)
    return 800.0 * float(np.linalg.norm(away) + abs(growth))


def cylinder_error_px(found: tuple[FloatArray, FloatArray], truth: FloatArray) -> float:
    one, other = lines_of_cylinder(*found)
    direct = max(np.linalg.norm(one - truth[0]), np.linalg.norm(other - truth[1]))
    crossed = max(np.linalg.norm(one - truth[1]), np.linalg.norm(other - truth[0]))
    return 800.0 * float(min(direct, crossed))


@pytest.mark.parametrize("radius_px", [20.0, 40.0, 61.0, 120.0, 200.0])
@pytest.mark.parametrize("scene", ["plain", "cluttered", "blocks"])
def test_spheres_of_any_size_are_the_first_candidate(radius_px: float, scene: str) -> None:
    rng = np.random.default_rng(int(radius_px))
    for _ in range(3):
        s = sphere_at(rng, radius_px)
        look = Look() if scene == "plain" else hard_look(rng, float(rng.uniform(2.0, 12.0)))
        look = replace(look, background=blocks(rng)) if scene == "blocks" else look
        image = render(s, None, look, rng)
        grid = grid_for(DEFAULT_INTRINSICS, SHAPE, "sphere")
        candidates = detect_spheres(image, grid, pack_camera(DEFAULT_INTRINSICS))
        assert sphere_error_px(candidates[0], s) < 8.0


@pytest.mark.parametrize("width_px", [60.0, 120.0, 240.0, 400.0])
@pytest.mark.parametrize("scene", ["plain", "cluttered"])
def test_cylinders_of_any_width_are_among_the_candidates(width_px: float, scene: str) -> None:
    rng = np.random.default_rng(int(width_px))
    for _ in range(3):
        s, axis = cylinder_at(rng, width_px)
        look = Look() if scene == "plain" else hard_look(rng, float(rng.uniform(2.0, 12.0)))
        image = render(s, axis, look, rng)
        grid = grid_for(DEFAULT_INTRINSICS, SHAPE, "cylinder")
        candidates = detect_cylinders(image, grid, pack_camera(DEFAULT_INTRINSICS))
        truth = np.stack(lines_of_cylinder(s, axis))
        assert min(cylinder_error_px(c, truth) for c in candidates) < 12.0


def test_dark_targets_are_found_when_asked_for() -> None:
    rng = np.random.default_rng(4)
    s = sphere_at(rng, 50.0)
    image = render(s, None, Look(foreground=30.0, background=180.0), rng)
    grid = grid_for(DEFAULT_INTRINSICS, SHAPE, "sphere")
    camera = pack_camera(DEFAULT_INTRINSICS)
    assert sphere_error_px(detect_spheres(image, grid, camera, -1.0)[0], s) < 4.0
    bright = detect_spheres(image, grid, camera, 1.0)
    assert all(sphere_error_px(found, s) > 20.0 for found in bright)


def test_grid_rays_invert_the_projection_and_gradients_turn_with_it() -> None:
    for projection in ("stereographic", "pinhole"):
        grid = make_grid(LENS, SHAPE, projection)
        for i, j in ((3, 5), (60, 80), (100, 150)):
            ray = grid.ray(*grid.xy[i, j])
            pixel = LENS.project(ray[None])[0]
            assert np.allclose(pixel, [4 * j + 1.5, 4 * i + 1.5], atol=1e-6)
            step = grid.xy[i, j + 1] - grid.xy[i, j - 1]
            along_u = np.array([1.0, 0.0])
            # One grey level per reduced pixel along u is two over two pixels to the right.
            assert (grid.gradient[i, j] @ along_u) @ step == pytest.approx(2.0, rel=2e-3)


def test_an_empty_image_has_no_candidates() -> None:
    flat = np.full(SHAPE, 77, np.uint8)
    camera = pack_camera(DEFAULT_INTRINSICS)
    assert detect_spheres(flat, grid_for(DEFAULT_INTRINSICS, SHAPE, "sphere"), camera) == []
    assert detect_cylinders(flat, grid_for(DEFAULT_INTRINSICS, SHAPE, "cylinder"), camera) == []
