"""Edge points and robust outlines: exact geometry first, then fits on exact images."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimator.image.edges_camera import normalised_of, pack_camera, pixel_of
from estimator.image.edges_cylinder import cylinder_of_lines, lines_of_cylinder
from estimator.image.edges_fit import fit_cylinder_edges, fit_sphere_edges
from estimator.image.edges_sphere import consensus_cone, fit_cone, s_of_cone
from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.image.outline_normals import line_normals, sphere_normals
from tests.estimator.image.exact_images import (
    DEFAULT_INTRINSICS,
    Look,
    cylinder_s,
    hard_look,
    render,
)

LENS = Intrinsics(790.0, 810.0, 310.0, 250.0, np.array([-0.25, 0.08, 1e-3, -5e-4, 0.01]))
S = np.array([1.2, -0.8, 12.5])
AXIS = np.array([0.3, 0.9, 0.3162]) / np.linalg.norm([0.3, 0.9, 0.3162])


def unit_rays(pixels: FloatArray, intrinsics: Intrinsics) -> FloatArray:
    xy = intrinsics.normalise(pixels)
    rays = np.concatenate([xy, np.ones((len(xy), 1))], axis=1)
    unit: FloatArray = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return unit


@pytest.mark.parametrize("intrinsics", [DEFAULT_INTRINSICS, LENS])
def test_compiled_camera_maps_are_those_of_the_intrinsics(intrinsics: Intrinsics) -> None:
    camera = pack_camera(intrinsics)
    for pixel in np.random.default_rng(1).uniform((0, 0), (639, 479), (20, 2)):
        xy = normalised_of(camera, *pixel)
        assert np.allclose(xy, intrinsics.normalise(pixel[None])[0], atol=1e-11)
        assert np.allclose(pixel_of(camera, *xy), pixel, atol=1e-8)


@pytest.mark.parametrize("intrinsics", [DEFAULT_INTRINSICS, LENS])
def test_sphere_outline_lies_on_its_cone_and_kappa_converts_angles(intrinsics: Intrinsics) -> None:
    rows = sphere_normals(pack_camera(intrinsics), S, 40)
    rays = unit_rays(rows[:, :2], intrinsics)
    assert np.allclose((rays @ S) ** 2, S @ S - 1.0, rtol=1e-10)
    outside = unit_rays(rows[:, :2] + 0.01 * rows[:, 2:4], intrinsics)
    angle = np.arccos(outside @ S / np.linalg.norm(S)) - np.arcsin(1.0 / np.linalg.norm(S))
    assert np.allclose(angle * rows[:, 4], 0.01, rtol=1e-3)


@pytest.mark.parametrize("intrinsics", [DEFAULT_INTRINSICS, LENS])
def test_cylinder_lines_lie_on_tangent_planes_and_point_outwards(intrinsics: Intrinsics) -> None:
    s = cylinder_s(S, AXIS)
    for n in lines_of_cylinder(s, AXIS):
        rows = line_normals(pack_camera(intrinsics), n, 30, 640, 480)
        assert len(rows) == 30
        assert np.allclose(unit_rays(rows[:, :2], intrinsics) @ n, 0.0, atol=1e-9)
        outside = unit_rays(rows[:, :2] + 0.01 * rows[:, 2:4], intrinsics) @ n
        assert np.allclose(-outside * rows[:, 4], 0.01, rtol=1e-3)


@settings(deadline=None)  # the first example may compile
@given(
    st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(2.0, 40.0),
    st.floats(0.0, np.pi), st.floats(-1.0, 1.0),
)  # fmt: skip
def test_lines_and_cylinder_are_inverse_and_normals_point_to_the_axis(
    x: float, y: float, z: float, roll: float, tilt: float
) -> None:
    axis = np.array([np.cos(roll) * np.cos(tilt), np.sin(roll) * np.cos(tilt), np.sin(tilt)])
    s = cylinder_s(np.array([x, y, z]), axis)
    if s @ s < 1.1:
        return
    n1, n2 = lines_of_cylinder(s, axis)
    # P0 = s R, so that n.P0 = R becomes n.s = 1.
    assert n1 @ s == pytest.approx(1.0) and n2 @ s == pytest.approx(1.0)
    back_s, back_axis = cylinder_of_lines(n1, n2)
    assert np.allclose(back_s, s, rtol=1e-9, atol=1e-9)
    assert np.allclose(back_axis, axis, atol=1e-7)


def test_cone_fit_ignores_a_third_of_wrong_edges() -> None:
    camera = pack_camera(DEFAULT_INTRINSICS)
    rows = sphere_normals(camera, S, 90)
    rays = np.zeros((90, 4, 3))
    rays[:, 0] = unit_rays(rows[:, :2], DEFAULT_INTRINSICS)
    wrong = np.arange(90) % 3 == 0
    rays[wrong, 0] = unit_rays(rows[wrong, :2] + 2.0 * rows[wrong, 2:4], DEFAULT_INTRINSICS)
    strengths = np.zeros((90, 4))
    strengths[:, 0] = 100.0
    start, score = consensus_cone(rays, strengths, rows, S + np.array([0.01, -0.01, 0.05]), 1)
    assert score > 50.0
    w, inverse, residuals, scale, fitted = fit_cone(rays, strengths, rows, start, 3.0)
    assert fitted
    s, _ = s_of_cone(w, scale**2 * inverse)
    assert np.allclose(s, S, atol=1e-8)
    assert np.allclose(np.abs(residuals[~wrong]), 0.0, atol=1e-6)


def test_covariance_of_s_follows_from_that_of_w() -> None:
    w = S / np.sqrt(S @ S - 1.0)
    covariance_w = np.diag([1e-8, 4e-8, 9e-10])
    _, covariance = s_of_cone(w, covariance_w)
    step = 1e-7
    jacobian = np.stack(
        [(s_of_cone(w + d, covariance_w)[0] - s_of_cone(w - d, covariance_w)[0]) / (2 * step)
         for d in step * np.eye(3)], axis=1
    )  # fmt: skip
    assert np.allclose(covariance, jacobian @ covariance_w @ jacobian.T, rtol=1e-4)


@pytest.mark.parametrize("hard", [False, True])
def test_sphere_edges_bring_a_poor_guess_to_a_fraction_of_a_pixel(hard: bool) -> None:
    rng = np.random.default_rng(2)
    look = hard_look(rng) if hard else Look()
    image = render(S, None, look, rng)
    guess = S + np.array([10.0, -8.0, 0.0]) / 800.0 * S[2] + np.array([0.0, 0.0, 0.3])
    fit = fit_sphere_edges(image, pack_camera(DEFAULT_INTRINSICS), guess, 1.0)
    assert fit is not None
    limit_px = 0.3 if hard else 0.05
    away = fit.s / np.linalg.norm(fit.s) - S / np.linalg.norm(S)
    assert 800.0 * np.linalg.norm(away) < limit_px
    assert 800.0 * abs(1.0 / np.linalg.norm(fit.s) - 1.0 / np.linalg.norm(S)) < limit_px


@pytest.mark.parametrize("hard", [False, True])
def test_cylinder_edges_bring_a_poor_guess_to_a_fraction_of_a_pixel(hard: bool) -> None:
    rng = np.random.default_rng(3)
    s = cylinder_s(S * 0.7, AXIS)
    image = render(s, AXIS, hard_look(rng) if hard else Look(), rng)
    guess = cylinder_s(s + 9.0 / 800.0 * s[2] * np.array([1.0, 0.0, 0.0]), AXIS)
    fit = fit_cylinder_edges(image, pack_camera(DEFAULT_INTRINSICS), guess, AXIS, 1.0)
    assert fit is not None and fit.axis is not None
    limit = (0.3 if hard else 0.1) / 800.0
    found, true = lines_of_cylinder(fit.s, fit.axis), lines_of_cylinder(s, AXIS)
    for n, n_true in zip(found, true, strict=True):
        assert abs((n - n_true) @ s) / np.linalg.norm(s) < limit


def test_no_edges_no_fit() -> None:
    flat = np.full((480, 640), 80, np.uint8)
    camera = pack_camera(DEFAULT_INTRINSICS)
    assert fit_sphere_edges(flat, camera, S, 1.0) is None
    assert fit_cylinder_edges(flat, camera, cylinder_s(S, AXIS), AXIS, 1.0) is None
