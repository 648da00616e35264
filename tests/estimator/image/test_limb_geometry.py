"""The cone, the pixel's ray and the blurred edge against exact projection and differences."""

import numpy as np
import pytest

from estimator.image.cone import derivatives, distance, moved, outline_frame, side
from estimator.image.intrinsics import Intrinsics
from estimator.image.limb_locate import locate
from estimator.image.limb_pixels import BEND, DISTANCE, GEOMETRY, NU, NV, collect, ray_of_pixel
from estimator.image.limb_profile import edge_rise, edge_step

SPHERE = (np.array([1.2, -0.8, 12.0]), np.zeros(3))
_AXIS = np.array([0.8, 0.55, 0.24]) / np.linalg.norm([0.8, 0.55, 0.24])
_POINT = np.array([0.5, -1.0, 9.0])
CYLINDER = (_POINT - _AXIS * float(_AXIS @ _POINT), _AXIS)
BOTH = pytest.mark.parametrize(("s", "a"), [SPHERE, CYLINDER], ids=["sphere", "cylinder"])
LENS = Intrinsics(800.0, 790.0, 319.5, 239.5, np.array([-0.3, 0.1, 0.001, -0.0015, 0.02]))


def tangent_ray(s: np.ndarray, a: np.ndarray, turn: float) -> np.ndarray:
    """A ray from the camera that touches the unit surface around s, found by its contact."""
    frame = outline_frame(s, a)
    length = float(np.linalg.norm(s))
    lean = np.sqrt(1.0 - 1.0 / length**2)
    if not a.any():
        across = np.cos(turn) * frame[0] + np.sin(turn) * frame[1]
        contact = s - frame[2] / length + lean * across
    else:
        across = frame[1] if np.sin(turn) > 0.0 else -frame[1]
        contact = s - frame[2] / length + lean * across + 3.0 * np.cos(turn) * a
    ray: np.ndarray = contact / contact[2]
    return ray


@BOTH
def test_rays_that_touch_the_target_lie_on_the_cone(s: np.ndarray, a: np.ndarray) -> None:
    for turn in np.linspace(0.1, 6.0, 13):
        x, y, _ = tangent_ray(s, a, float(turn))
        assert abs(side(x, y, s, a)[0]) < 1e-12 * np.linalg.norm(s)


@BOTH
def test_derivatives_agree_with_differences(s: np.ndarray, a: np.ndarray) -> None:
    frame, count = outline_frame(s, a), 4 if a.any() else 3
    exact = np.empty(count)
    derivatives(0.05, -0.03, s, a, frame, count, exact)
    for i in range(count):
        step = np.zeros(count)
        step[i] = 1e-6
        ahead = side(0.05, -0.03, *moved(s, a, frame, step))[0]
        behind = side(0.05, -0.03, *moved(s, a, frame, -step))[0]
        assert exact[i] == pytest.approx((ahead - behind) / 2e-6, abs=1e-7)


@BOTH
def test_moved_keeps_the_axis_unit_and_normal_to_s(s: np.ndarray, a: np.ndarray) -> None:
    step = np.array([0.3, 0.02, -0.05, 0.1])[: 4 if a.any() else 3]
    s_new, a_new = moved(s, a, outline_frame(s, a), step)
    assert np.linalg.norm(a_new) == pytest.approx(np.linalg.norm(a), abs=1e-12)
    assert abs(s_new @ a_new) < 1e-12
    assert np.linalg.norm(s_new) == pytest.approx(np.linalg.norm(s) + 0.3)


@BOTH
@pytest.mark.parametrize("offset_px", [-3.0, -0.5, 0.7, 4.0])
def test_distance_is_the_distance_to_the_outline(
    s: np.ndarray, a: np.ndarray, offset_px: float
) -> None:
    f_px = 800.0
    j = (1.0 / f_px, 0.0, 0.0, 1.0 / f_px)
    for turn in (0.4, 2.0, 4.0, 5.5):
        x, y, _ = tangent_ray(s, a, turn)
        _, nu, nv, _, _ = distance(x, y, *j, s, a)
        d, *_ = distance(x + offset_px * nu / f_px, y + offset_px * nv / f_px, *j, s, a)
        # Third order in the offset: exact where the edge is, slightly off where only slopes are.
        assert d == pytest.approx(offset_px, abs=2e-6 * (abs(offset_px) + abs(offset_px) ** 3))


def test_a_centred_spheres_outline_bends_with_its_apparent_radius() -> None:
    s = np.array([0.0, 0.0, 13.0])
    radius_px = 800.0 / np.sqrt(13.0**2 - 1.0)
    *_, bend, _ = distance(radius_px / 800.0, 0.0, 1 / 800.0, 0.0, 0.0, 1 / 800.0, s, np.zeros(3))
    assert bend == pytest.approx(1.0 / radius_px, rel=1e-6)


def test_rays_and_their_jacobian_invert_the_lens() -> None:
    camera = np.array([LENS.fx_px, LENS.fy_px, LENS.cx_px, LENS.cy_px, *LENS.distortion])
    pixels = np.random.default_rng(1).uniform((0.0, 0.0), (639.0, 479.0), (40, 2))
    expected = LENS.normalise(pixels)
    for (u, v), xy in zip(pixels, expected, strict=True):
        ray = np.zeros(6)
        ray_of_pixel(u, v, camera, ray)
        assert ray[:2] == pytest.approx(xy, abs=1e-9)
        beside = LENS.normalise(
            np.array([[u + 1e-3, v], [u - 1e-3, v], [u, v + 1e-3], [u, v - 1e-3]])
        )
        du, dv = (beside[0] - beside[1]) / 2e-3, (beside[2] - beside[3]) / 2e-3
        assert ray[2:] == pytest.approx([du[0], dv[0], du[1], dv[1]], abs=1e-8)


@BOTH
def test_collected_pixels_are_those_near_the_outline_and_are_located_as_by_the_cone(
    s: np.ndarray, a: np.ndarray
) -> None:
    camera = np.array([LENS.fx_px, LENS.fy_px, LENS.cx_px, LENS.cy_px, *LENS.distortion])
    frame, count = outline_frame(s, a), 4 if a.any() else 3
    pixels, starts = collect(np.zeros((480, 640), np.uint8), camera, s, a, 5.0, 6.0, 14.0)
    locate(pixels, s, a, frame)
    assert starts[-1] == pixels.shape[1]
    d = pixels[DISTANCE]
    assert d.min() > -6.1 and d.max() < 5.1
    v, u = (grid.ravel().astype(float) for grid in np.mgrid[:480, :640])
    x, y = LENS.normalise(np.stack([u, v], axis=-1)).T
    near = 0
    for i in range(0, len(u), 37):
        ray = np.array([x[i], y[i], 0.0, 0.0, 0.0, 0.0])
        ray_of_pixel(u[i], v[i], camera, ray)
        d_here = distance(ray[0], ray[1], ray[2], ray[3], ray[4], ray[5], s, a)[0]
        near += -5.9 < d_here < 4.9
    inner = np.count_nonzero((d > -5.9) & (d < 4.9))
    assert near == pytest.approx(inner / 37, rel=0.1)
    derived = np.empty(count)
    for i in range(0, pixels.shape[1], 211):
        x0, y0, x_u, x_v, y_u, y_v = pixels[:6, i]
        expected = distance(x0, y0, x_u, x_v, y_u, y_v, s, a)
        found = pixels[[DISTANCE, NU, NV, BEND], i]
        assert found == pytest.approx(expected[:4], abs=1e-9)
        nu, nv = expected[1:3]
        foot_x = x0 - expected[0] * (x_u * nu + x_v * nv)
        foot_y = y0 - expected[0] * (y_u * nu + y_v * nv)
        derivatives(foot_x, foot_y, s, a, frame, count, derived)
        assert pixels[GEOMETRY : GEOMETRY + count, i] == pytest.approx(
            derived / expected[4], abs=1e-8
        )


def edge(d: float, a: float, b: float, w: float) -> np.ndarray:
    """Share, its derivatives by d, w^2 and variance, rise, root and the root's derivative."""
    return np.array([*edge_step(d, a, b, w), *edge_rise(d, a, b, w)])


@pytest.mark.parametrize("widths", [(0.7, 0.7, 3.0), (1.0, 0.05, 0.05), (0.9, 0.4, 1.2)])
def test_the_edge_profile_is_a_step_seen_through_three_boxes(
    widths: tuple[float, float, float],
) -> None:
    cells = (np.arange(60) + 0.5) / 60 - 0.5
    p, q, r = (cells * w for w in widths)
    offsets = (p[:, None, None] + q[:, None] + r).ravel()
    for d in (-1.3, -0.4, 0.0, 0.35, 1.1, 2.5):
        x = np.maximum(d + offsets, 0.0)
        seen = edge(d, *widths)
        assert seen[0] == pytest.approx(np.mean(d + offsets > 0.0), abs=1e-2)
        assert seen[4] == pytest.approx(np.mean(x), abs=1e-3)
        assert seen[5] == pytest.approx(np.mean(np.sqrt(x)), abs=4e-3)


def test_the_edge_profiles_derivatives_agree_with_differences() -> None:
    a, b, w = 0.8, 0.6, 1.5
    for d in (-0.9, -0.2, 0.3, 1.0):
        seen, h = edge(d, a, b, w), 1e-5
        ahead, behind = edge(d + h, a, b, w), edge(d - h, a, b, w)
        assert seen[1] == pytest.approx((ahead[0] - behind[0]) / (2 * h), abs=1e-6)
        assert seen[3] == pytest.approx((ahead[1] - behind[1]) / (4 * h), abs=1e-4)
        assert seen[6] == pytest.approx((ahead[5] - behind[5]) / (2 * h), abs=1e-6)
        wider = edge(d, a, b, np.sqrt(w * w + h))
        narrower = edge(d, a, b, np.sqrt(w * w - h))
        assert seen[2] == pytest.approx((wider[0] - narrower[0]) / (2 * h), abs=1e-6)
