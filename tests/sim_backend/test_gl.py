"""MuJoCo's OpenGL renderer, held against the software renderer."""

import threading

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from sim_backend.config import SimConfig
from sim_backend.config_targets import StartPose
from sim_backend.gl import GlRenderer
from sim_backend.raster import RasterRenderer
from tests.sim_backend.charuco import expected, found, rms
from tests.sim_backend.helpers import FLAT, coverage, drawn, view

pytestmark = [pytest.mark.gl, pytest.mark.usefixtures("gl")]

LENSES = {
    "pinhole": {},
    "distorted": {"camera": {"distortion": (-0.15, 0.03, 0.001, -0.001, 0.0)}},
    "off-centre": {"camera": {"cx": 310.0, "cy": 250.5}},
}


def gl_drawn(scene, lens, T):
    """The picture by OpenGL."""
    renderer = GlRenderer(scene, lens)
    try:
        return renderer.render(T[None], (0, lens.height)).astype(float)
    finally:
        renderer.close()


def radial_difference_px(first, second, centre):
    """Per 10° sector, how much further out the outline of a disc lies in ``second``."""
    v, u = np.mgrid[0 : first.shape[0], 0 : first.shape[1]]
    angle = np.arctan2(v - centre[1], u - centre[0])
    sector = np.floor((angle + np.pi) / (2 * np.pi) * 36).clip(0, 35).astype(int)
    radius = np.sqrt(first.sum() / np.pi)
    difference = np.bincount(sector.ravel(), (second - first).ravel(), 36)
    return difference / (radius * 2 * np.pi / 36)


@pytest.mark.parametrize("lens_name", LENSES)
@pytest.mark.parametrize("distance_m", [0.22, 0.4])
def test_outlines_of_spheres_agree_within_a_fortieth_of_a_pixel(lens_name, distance_m):
    start = StartPose(distance_m=distance_m, tilt_y_deg=20, offset_px=(60.3, -40.2))
    scene, lens, T = view("sphere", start, **FLAT, **LENSES[lens_name])
    exact, seen = coverage(drawn(scene, lens, T)), coverage(gl_drawn(scene, lens, T))
    v, u = np.mgrid[0 : lens.height, 0 : lens.width]
    centre = np.array([(exact * u).sum(), (exact * v).sum()]) / exact.sum()
    difference = radial_difference_px(exact, seen, centre)
    assert np.sqrt(np.mean(difference**2)) < 0.025
    # What a radius sees of it, of about 60 px.
    assert abs(np.mean(difference)) < 0.01


@pytest.mark.parametrize("lens_name", LENSES)
@pytest.mark.parametrize("spin_deg", [0, 30, 75])
def test_outlines_of_cylinders_agree_within_a_fortieth_of_a_pixel(lens_name, spin_deg):
    start = StartPose(distance_m=0.4, tilt_x_deg=15, spin_deg=spin_deg)
    scene, lens, T = view("cylinder", start, **FLAT, **LENSES[lens_name])
    exact, seen = coverage(drawn(scene, lens, T)), coverage(gl_drawn(scene, lens, T))
    a = T[:3, :3].T @ scene.target.axis
    if abs(a[0]) > abs(a[1]):
        exact, seen = exact.T, seen.T
    # Bundles of 20 scan lines, each side of the strip for itself.
    lines = exact.shape[0] // 20
    errors = []
    for k in range(lines):
        block, other = exact[20 * k : 20 * k + 20], seen[20 * k : 20 * k + 20]
        middle = round(float((block * np.arange(block.shape[1])).sum() / block.sum()))
        difference = (other - block).sum(axis=0) / 20
        errors += [difference[:middle].sum(), difference[middle:].sum()]
    assert np.sqrt(np.mean(np.square(errors))) < 0.025
    assert abs(np.mean(errors)) < 0.01


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_shading_and_texture_are_about_the_same(target):
    start = getattr(SimConfig(), target).start
    scene, lens, T = view(target, start)
    ours, theirs = drawn(scene, lens, T), gl_drawn(scene, lens, T)
    inside = binary_erosion(ours > 100, iterations=2)
    assert np.abs(ours - theirs)[inside].max() < 2.0
    floor = ours < 62
    assert np.corrcoef(ours[floor], theirs[floor])[0, 1] > 0.99


def test_it_averages_poses_and_cuts_rows():
    scene, lens, T = view("sphere", StartPose(distance_m=0.3))
    poses = np.repeat(T[None], 2, axis=0)
    poses[1, 0, 3] += 0.002
    renderer = GlRenderer(scene, lens)
    both = renderer.render(poses, (100, 300))
    single = [renderer.render(p[None], (0, 480)) for p in poses]
    renderer.close()
    renderer.close()
    np.testing.assert_allclose(both, (single[0] + single[1])[100:300] / 2)
    blurred = RasterRenderer(scene, lens).render(poses, (100, 300))
    assert np.abs(both - blurred).mean() < 1.0


def test_threads_may_take_turns_with_one_renderer():
    scene, lens, T = view("sphere", StartPose(distance_m=0.3))
    renderer = GlRenderer(scene, lens)
    here = renderer.render(T[None], (0, 480))
    there = []
    thread = threading.Thread(target=lambda: there.append(renderer.render(T[None], (0, 480))))
    thread.start()
    thread.join()
    np.testing.assert_array_equal(there[0], here)
    np.testing.assert_array_equal(renderer.render(T[None], (0, 480)), here)
    renderer.close()


@pytest.mark.parametrize("lens_name", LENSES)
def test_corners_of_a_board_agree_within_a_twentieth_of_a_pixel(lens_name):
    settings = LENSES[lens_name]
    config = SimConfig.model_validate(settings)
    errors, differences = [], []
    for tilt_deg in (-30, 5, 25):
        start = StartPose(distance_m=0.38, tilt_x_deg=tilt_deg, tilt_y_deg=12, spin_deg=tilt_deg)
        scene, lens, T = view("board", start, **settings)
        pixels, points = found(gl_drawn(scene, lens, T), config.board)
        exact = expected(points, scene.target, lens, T)
        assert len(points) > 18
        errors.append(pixels - exact)
        differences.append(gl_drawn(scene, lens, T) - drawn(scene, lens, T))
    assert rms(np.concatenate(errors)) < 0.05
    assert rms(np.array(differences)) < 8.0


def test_a_board_is_white_from_behind_and_hides_and_is_hidden_as_in_the_software_renderer():
    near = {"radius_m": 0.02, "position_m": (0.03, 0.0, 0.35), "albedo_grey": 90.0}
    far = {"radius_m": 0.05, "position_m": (-0.12, 0.0, 0.2), "albedo_grey": 140.0}
    start = SimConfig().board.start
    scene, lens, T = view("board", start, **FLAT, distractor_spheres=[near, far])
    below = np.eye(4)
    below[:3, 3] = (0.0, 0.0, 0.2)
    for pose in (T, below):
        difference = np.abs(gl_drawn(scene, lens, pose) - drawn(scene, lens, pose))
        assert np.median(difference) < 0.6
        assert np.mean(difference > 40) < 0.005
