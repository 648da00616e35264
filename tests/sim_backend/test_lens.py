"""The simulated lens, held against OpenCV's."""

import cv2
import numpy as np
import pytest

from sim_backend.config import CameraConfig
from sim_backend.config_targets import StartPose
from sim_backend.lens import lens_of
from tests.sim_backend.helpers import FLAT, built, camera, coverage

DISTORTION = (-0.21, 0.06, 0.0012, -0.0017, 0.004)


def test_the_corners_of_pixels_lie_half_way_between_their_centres():
    lens = lens_of(CameraConfig(width=64, height=48, focal_px=80.0, distortion=DISTORTION))
    corners, centres = lens.corner_ray_table(), lens.ray_table()
    assert corners.shape == (2, 49, 65)
    between = (corners[:, :-1, :-1] + corners[:, 1:, 1:]) / 2
    np.testing.assert_allclose(between, centres, atol=5e-5)  # 0.004 px
    first = lens.to_rays(np.array([[-0.5, -0.5], [63.5, 47.5]]))
    np.testing.assert_allclose(corners[:, 0, 0], first[0], atol=1e-7)
    np.testing.assert_allclose(corners[:, -1, -1], first[1], atol=1e-7)


def test_the_lens_is_opencvs():
    lens = lens_of(CameraConfig(distortion=DISTORTION, fx=812.0, fy=790.0, cx=315.0, cy=247.0))
    points = np.random.default_rng(3).uniform([-0.3, -0.2, 0.8], [0.3, 0.2, 1.2], (200, 3))
    K = np.array([[812.0, 0.0, 315.0], [0.0, 790.0, 247.0], [0.0, 0.0, 1.0]])
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, np.array(DISTORTION))
    np.testing.assert_allclose(lens.project(points), expected[:, 0], atol=1e-9)
    rays = lens.to_rays(expected[:, 0])
    np.testing.assert_allclose(rays, points[:, :2] / points[:, 2:], atol=1e-12)


def test_a_distorted_picture_shows_the_sphere_where_opencv_projects_it():
    start = StartPose(distance_m=0.4, offset_px=(220.0, -150.0))
    rig, _ = built(
        "sphere",
        **FLAT,
        sphere={"start": start.model_dump()},
        camera=camera(distortion=DISTORTION, fx=812.0, fy=790.0),
    )
    frame = rig.camera.read(1.0)
    covered = coverage(frame.image.astype(float))
    v, u = np.mgrid[0:480, 0:640]
    seen = np.array([(covered * u).sum(), (covered * v).sum()]) / covered.sum()
    fx, fy, cx, cy, distortion = rig.intrinsics
    s = rig.truth.s(frame.t_exposure_mid_s)
    e = s / np.linalg.norm(s)
    a = np.cross(e, [0.0, 0.0, 1.0])
    a /= np.linalg.norm(a)
    half = np.arcsin(1 / np.linalg.norm(s))
    turns = np.linspace(0, 2 * np.pi, 721)[:-1, None]
    rim = np.cos(half) * e + np.sin(half) * (np.cos(turns) * a + np.sin(turns) * np.cross(e, a))
    K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    outline, _ = cv2.projectPoints(rim, np.zeros(3), np.zeros(3), K, distortion)
    moments = cv2.moments(outline.astype(np.float32))
    expected = np.array([moments["m10"], moments["m01"]]) / moments["m00"]
    np.testing.assert_allclose(seen, expected, atol=0.02)
    assert np.sqrt(covered.sum()) == pytest.approx(np.sqrt(moments["m00"]), rel=1e-3)
