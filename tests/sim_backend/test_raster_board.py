"""The software renderer's board, held against exact projection and against brute force."""

import numpy as np
import pytest

from sim_backend.config import SimConfig
from sim_backend.config_targets import StartPose
from sim_backend.lens import lens_of
from sim_backend.raster import RasterRenderer
from sim_backend.scene import build_scene
from tests.sim_backend.charuco import expected, found, rms
from tests.sim_backend.helpers import FLAT, built, camera, drawn, view

DISTORTED = {
    "camera": {
        "distortion": (-0.2, 0.05, 0.001, -0.002, 0.0),
        "fx": 812.0,
        "fy": 806.0,
        "cx": 315.2,
        "cy": 243.1,
    }
}
SWING = np.array([0.12, 0.10, 0.03, 0.1, 0.1, 0.3])


def random_start(random):
    """A view of which calibration might make use."""
    tilts = random.uniform(-35, 35, 2)
    return StartPose(
        distance_m=random.uniform(0.28, 0.5),
        tilt_x_deg=tilts[0],
        tilt_y_deg=tilts[1],
        spin_deg=random.uniform(-180, 180),
        offset_px=tuple(random.uniform(-50, 50, 2)),
    )


def by_brute_force(scene, lens, T, n):
    """The picture as the mean of n x n rays in every pixel."""
    inside = (np.arange(n) + 0.5) / n - 0.5
    u = (np.arange(lens.width)[:, None] + inside).ravel()
    v = (np.arange(lens.height)[:, None] + inside).ravel()
    pixels = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    rays = np.column_stack([lens.to_rays(pixels), np.ones(len(pixels))])
    board = scene.board
    T_board_camera = np.linalg.inv(board.T_base_board) @ T
    direction, origin = rays @ T_board_camera[:3, :3].T, T_board_camera[:3, 3]
    x, y = (origin - origin[2] * direction / direction[:, 2:])[:, :2].T
    greys = np.pad(board.greys, 1, constant_values=scene.floor.mean_grey)
    i = np.searchsorted(board.rows_m, y, side="right")
    j = np.searchsorted(board.columns_m, x, side="right")
    return greys[i, j].reshape(lens.height, n, lens.width, n).mean(axis=(1, 3))


@pytest.mark.parametrize("distance_m", [0.3, 0.5, 2.0])
def test_every_pixel_is_the_mean_over_its_area(distance_m):
    small = {"width": 48, "height": 36, "fx": 260.0, "fy": 256.0, "distortion": (-0.2, 0, 0, 0, 0)}
    start = StartPose(distance_m=distance_m, tilt_x_deg=32, tilt_y_deg=-15, spin_deg=27)
    scene, lens, T = view("board", start, **FLAT, camera=small)
    error = drawn(scene, lens, T) - by_brute_force(scene, lens, T, 20)
    # What remains is the brute force's own error: an edge between two of its rays.
    assert rms(error) < 0.5
    assert abs(error.mean()) < 0.05
    assert np.abs(error).max() < 4.0


@pytest.mark.parametrize("lens_settings", [{}, DISTORTED], ids=["pinhole", "distorted"])
def test_corners_lie_where_they_project_to(lens_settings):
    random = np.random.default_rng(3)
    config = SimConfig.model_validate(lens_settings)
    scene, lens = build_scene(config, "board"), lens_of(config.camera)
    errors = []
    for _ in range(12):
        T = view("board", random_start(random), **lens_settings)[2]
        pixels, points = found(drawn(scene, lens, T), config.board)
        assert len(points) >= 12
        errors.append(pixels - expected(points, scene.target, lens, T))
    errors = np.concatenate(errors)
    assert rms(errors) < 0.025
    assert np.abs(errors.mean(axis=0)).max() < 0.004


def test_rows_rendered_apart_are_the_rows_of_the_whole_picture():
    scene, lens, T = view("board", SimConfig().board.start, **DISTORTED)
    renderer = RasterRenderer(scene, lens)
    whole = renderer.render(T[None], (0, lens.height))
    for first, end in [(0, 1), (100, 101), (37, 205), (479, 480)]:
        part = renderer.render(T[None], (first, end))
        np.testing.assert_allclose(part, whole[first:end], atol=2e-4)


def test_few_sub_exposures_blur_like_many():
    scene, lens, T = view("board", SimConfig().board.start, **FLAT)
    renderer = RasterRenderer(scene, lens)
    poses = np.repeat(T[None], 13, axis=0)
    poses[:, 0, 3] += np.linspace(0.0, 0.0015, 13)  # 2.9 px
    together = renderer.render(poses, (0, 480))
    one_by_one = np.mean([renderer.render(p[None], (0, 480)) for p in poses], axis=0)
    sharp = renderer.render(T[None], (0, 480))
    # Fewer poses ripple a little within the blur, but shift nothing.
    assert rms(together - one_by_one) < 0.15 * rms(together - sharp)
    blurred = [found(image, SimConfig().board)[0] for image in (together, one_by_one)]
    assert rms(blurred[0] - blurred[1]) < 0.03
    assert np.abs((blurred[0] - blurred[1]).mean(axis=0)).max() < 0.005


@pytest.mark.parametrize("row_time_s", [0.0, 30e-6], ids=["global", "rolling"])
def test_corners_of_a_moving_board_lie_where_they_were_at_mid_exposure(row_time_s):
    rig, clock = built("board", camera=camera(exposure_s=0.004, row_time_s=row_time_s))
    config = SimConfig()
    lens, board = lens_of(config.camera), build_scene(config, "board").target
    errors, shifts = [], []
    for k in range(12):
        rig.arm.command_twist(SWING if k < 6 else -2.0 * SWING, 1.0)
        clock.sleep_until(clock.now_s() + 0.03)
        frame = rig.camera.read(0.1)
        pixels, points = found(frame.image, config.board)
        t_s = frame.t_exposure_mid_s
        exact = [
            expected(
                point[None],
                board,
                lens,
                rig.truth.T_base_camera(t_s + row_time_s * (pixel[1] - 239.5)),
            )[0]
            for pixel, point in zip(pixels, points, strict=True)
        ]
        later = expected(points, board, lens, rig.truth.T_base_camera(t_s + 0.001))
        errors.append((pixels - exact).mean(axis=0))
        shifts.append(np.linalg.norm((later - exact).mean(axis=0)))
    assert max(shifts) > 0.1  # px in 1 ms
    # A tenth of a millisecond would move the fastest of these pictures by 0.03 px.
    assert rms(np.array(errors)) < 0.012
