"""The software renderer's outlines, held against exact projection."""

import numpy as np
import pytest

from sim_backend.config import SimConfig
from sim_backend.config_targets import StartPose
from sim_backend.raster import RasterRenderer
from sim_backend.raster_pixel import covered_share
from sim_backend.scene import Cylinder, Sphere
from tests.sim_backend.helpers import (
    BLACK,
    FLAT,
    WHITE,
    circle,
    coverage,
    drawn,
    polygon_area_and_centroid,
    view,
)

DISTORTED = {"camera": {"distortion": (-0.2, 0.05, 0.001, -0.002, 0.0)}}
SPHERE_VIEWS = [
    StartPose(distance_m=0.27, offset_px=(0.3, -0.2)),
    StartPose(distance_m=0.22, tilt_x_deg=30, offset_px=(150.4, -90.7)),
    StartPose(distance_m=0.6, tilt_y_deg=-50, offset_px=(-240.2, 170.9)),
]


@pytest.mark.parametrize("start", SPHERE_VIEWS)
@pytest.mark.parametrize("lens_settings", [{}, DISTORTED], ids=["pinhole", "distorted"])
def test_a_sphere_covers_exactly_its_projection(start, lens_settings):
    scene, lens, T = view("sphere", start, **FLAT, **lens_settings)
    covered = coverage(drawn(scene, lens, T))
    centre = T[:3, :3].T @ (scene.target.centre_m - T[:3, 3])
    half_angle = np.arcsin(scene.target.radius_m / np.linalg.norm(centre))
    outline = lens.project(circle(np.linspace(0, 2 * np.pi, 4001)[:-1], centre, half_angle))
    area, centroid = polygon_area_and_centroid(outline)
    radius = np.sqrt(area / np.pi)
    v, u = np.mgrid[0 : lens.height, 0 : lens.width]
    seen = np.array([(covered * u).sum(), (covered * v).sum()]) / covered.sum()
    # An outline off by d everywhere changes the area by its length times d.
    assert abs(covered.sum() - area) / (2 * np.pi * radius) < 3e-4
    np.testing.assert_allclose(seen, centroid, atol=5e-4)


@pytest.mark.parametrize("spin_deg", [0, 17, 45, 80])
def test_a_cylinder_covers_exactly_the_strip_between_its_tangent_planes(spin_deg):
    start = StartPose(distance_m=0.5, tilt_x_deg=25, spin_deg=spin_deg, offset_px=(5.3, 7.1))
    settings = {**FLAT, "cylinder": {"direction": (0.0, 1.0, 0.0)}}
    scene, lens, T = view("cylinder", start, **settings)
    covered = coverage(drawn(scene, lens, T))
    assert isinstance(scene.target, Cylinder)
    a = T[:3, :3].T @ scene.target.axis
    Q = T[:3, :3].T @ (scene.target.middle_m - T[:3, 3])
    P0 = Q - a * (a @ Q)
    D = np.linalg.norm(P0)
    sine = scene.target.radius_m / D
    side = np.cross(a, P0 / D)
    across_rows = abs(a[0]) < abs(a[1])
    picture = covered if across_rows else covered.T
    for sign in (1, -1):
        n = sine * P0 / D + sign * np.sqrt(1 - sine**2) * side
        # Where the image line n·(x, y, 1) = 0 crosses each pixel row (or column).
        lines = np.arange(picture.shape[0])
        if across_rows:
            y = (lines - lens.cy_px) / lens.focal_px
            exact = lens.cx_px - lens.focal_px * (n[1] * y + n[2]) / n[0]
            inside_is_right = n[0] > 0
        else:
            x = (lines - lens.cx_px) / lens.focal_px
            exact = lens.cy_px - lens.focal_px * (n[0] * x + n[2]) / n[1]
            inside_is_right = n[1] > 0
        middle = picture.shape[1] // 2
        other = np.where(np.arange(picture.shape[1]) < middle, -1, 1)
        near = (np.abs(np.arange(picture.shape[1]) - exact[:, None]) < 6) & (other != 0)
        usable = np.abs(exact - middle) < middle - 8
        counted = np.where(near, picture, 0.0).sum(axis=1)
        first = np.argmax(near, axis=1) - 0.5
        size = near.sum(axis=1)
        expected = np.where(inside_is_right, first + size - exact, exact - first)
        error = (counted - expected)[usable]
        assert usable.sum() > 100
        assert np.abs(error.mean()) < 1e-4
        assert np.abs(error).max() < 2e-3


@pytest.mark.parametrize("angle", np.linspace(0, 2 * np.pi, 13))
@pytest.mark.parametrize("distance", [-0.8, -0.6, -0.3, 0.0, 0.1, 0.45, 0.65, 0.8])
def test_the_covered_share_of_a_pixel_is_its_area(distance, angle):
    n = 400
    p = (np.arange(n) + 0.5) / n - 0.5
    nu, nv = np.cos(angle), np.sin(angle)
    inside = distance + nu * p[None, :] + nv * p[:, None] >= 0
    assert covered_share(distance, nu, nv) == pytest.approx(inside.mean(), abs=3e-3)


def test_shading_is_lamberts_law():
    start = StartPose(distance_m=0.27, tilt_y_deg=20)
    settings = {
        "light": {"direction": (1.0, 0.5, 1.5), "ambient": 0.3},
        "background": FLAT["background"],
    }
    scene, lens, T = view("sphere", start, **settings)
    image = drawn(scene, lens, T)
    assert isinstance(scene.target, Sphere)
    for u, v in [(320, 240), (300, 220), (350, 262), (330, 200)]:
        ray = np.array([(u - lens.cx_px) / lens.focal_px, (v - lens.cy_px) / lens.focal_px, 1.0])
        direction = T[:3, :3] @ ray / np.linalg.norm(ray)
        to = T[:3, 3] - scene.target.centre_m
        b = direction @ to
        depth = -b - np.sqrt(b * b - to @ to + scene.target.radius_m**2)
        normal = (T[:3, 3] + depth * direction - scene.target.centre_m) / scene.target.radius_m
        lit = max(normal @ scene.light, 0.0)
        assert image[v, u] == pytest.approx(225.0 * (0.3 + 0.7 * lit), abs=0.05)


def test_the_default_light_shades_mildly_and_keeps_the_whole_limb_far_above_the_floor():
    config = SimConfig()
    for target in ("sphere", "cylinder"):
        scene, lens, T = view(target, getattr(config, target).start)
        image = drawn(scene, lens, T)
        inside = image[image > 100.0]
        assert inside.min() > 100.0 > image[:20, :40].max()
        assert inside.max() > 215.0
        assert np.ptp(inside) > 30.0


def test_the_nearer_object_hides_the_farther_one_whatever_their_order():
    near = {"radius_m": 0.01, "position_m": (0.0, 0.0, 0.4), "albedo_grey": 90.0}
    far = {"radius_m": 0.06, "position_m": (0.0, 0.0, 0.15), "albedo_grey": 140.0}
    start = StartPose(distance_m=0.3)
    images = []
    for order in ([near, far], [far, near]):
        scene, lens, T = view("sphere", start, **FLAT, distractor_spheres=order)
        images.append(drawn(scene, lens, T))
    np.testing.assert_array_equal(images[0], images[1])
    assert images[0][240, 320] == pytest.approx(90.0)  # the small near one
    assert images[0][240, 320 + 45] == pytest.approx(WHITE)  # the target behind it
    assert images[0][240, 320 + 80] == pytest.approx(140.0)  # the large one behind that
    assert images[0][10, 10] == pytest.approx(BLACK)


def test_a_cylinder_ends_where_its_length_says():
    post = {
        "radius_m": 0.02,
        "position_m": (0.15, 0.0, 0.30),
        "direction": (0.0, 1.0, 0.0),
        "length_m": 0.1,
        "albedo_grey": 100.0,
    }
    start = StartPose(distance_m=0.5)
    scene, lens, T = view("sphere", start, **FLAT, distractor_cylinders=[post])
    image = drawn(scene, lens, T)
    # Seen from above its middle line is nearest: 0.02 m closer than its axis.
    ends = lens.project(
        (np.array([[0.15, 0.05, 0.32], [0.15, -0.05, 0.32]]) - T[:3, 3]) @ T[:3, :3]
    )
    column = image[:, round(ends[0, 0])]
    covered = ((column - BLACK) / (100.0 - BLACK)).sum()
    # The far rim of an end may show below the near one: compare with the longer of the two.
    assert covered == pytest.approx(ends[1, 1] - ends[0, 1], abs=0.1)


def test_rows_rendered_apart_are_the_rows_of_the_whole_picture():
    scene, lens, T = view("cylinder", SimConfig().cylinder.start, **DISTORTED)
    renderer = RasterRenderer(scene, lens)
    whole = renderer.render(T[None], (0, lens.height))
    for first, end in [(0, 1), (100, 101), (37, 205), (479, 480)]:
        np.testing.assert_allclose(
            renderer.render(T[None], (first, end)), whole[first:end], atol=2e-4
        )


def test_sub_exposures_average_the_pictures():
    scene, lens, T = view("sphere", StartPose(distance_m=0.3), light=FLAT["light"])
    renderer = RasterRenderer(scene, lens)
    poses = np.repeat(T[None], 5, axis=0)
    poses[:, 0, 3] += np.linspace(0.0, 0.001, 5)  # 2.7 px
    together = renderer.render(poses, (0, 480))
    one_by_one = np.mean([renderer.render(p[None], (0, 480)) for p in poses], axis=0)
    outline = (one_by_one > 65) & (one_by_one < WHITE - 1)
    assert outline.sum() > 600
    assert np.abs(together - one_by_one)[outline].max() < 1e-3
    # Away from outlines the floor's texture is averaged over fewer poses.
    assert np.abs(together - one_by_one).max() < 1.5


def test_the_textured_floor_lies_still_and_stays_between_its_greys():
    start = StartPose(distance_m=0.5, tilt_x_deg=10)
    low_high = {"low_grey": 5.0, "high_grey": 110.0, "correlation_m": 0.02}
    scene, lens, T = view("sphere", start, background=low_high)
    first = drawn(scene, lens, T)
    floor = first[300:, :]
    assert floor.min() > 4.9
    assert floor.max() < 110.1
    assert floor.std() > 20.0
    # Move the camera and look the same floor point up again.
    moved = T.copy()
    moved[:3, 3] += [0.02, -0.01, 0.03]
    second = drawn(scene, lens, moved)
    u, v = 420, 400
    ray = T[:3, :3] @ [(u - lens.cx_px) / lens.focal_px, (v - lens.cy_px) / lens.focal_px, 1.0]
    point = T[:3, 3] - T[2, 3] / ray[2] * ray
    u2, v2 = lens.project(((point - moved[:3, 3]) @ moved[:3, :3])[None])[0]
    j, i = int(u2), int(v2)
    a, b = u2 - j, v2 - i
    patch = second[i : i + 2, j : j + 2]
    looked_up = np.array([1 - b, b]) @ patch @ np.array([1 - a, a])
    assert looked_up == pytest.approx(first[v, u], abs=1.0)
