"""A servo's task and its null space: what moves around the target leaves the task alone."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.active.null_space import AroundTarget
from estimator.active.servo import ServoController
from estimator.active.servo_task import ServoTask
from estimator.estimate import Estimate

FloatArray = NDArray[np.float64]

CHI, SPEED, SHARE = 50.0, 0.05, 0.002
AXIS = np.array([0.6, -0.8, 0.0])
BEARING = np.array([0.15, -0.1, 1.0]) / np.linalg.norm([0.15, -0.1, 1.0])
TASK = ServoTask(BEARING, 0.25, 800.0, 2.0, 0.001)
THERE = (1.0 + 0.25 * CHI) * BEARING
IMAGES = np.diag([1e-4, 1e-4, 14e-4]) ** 2


def known(s: FloatArray, axis: FloatArray | None, share: float) -> Estimate:
    """An estimate whose 95 % interval is about ± ``share`` wide."""
    std = share * CHI / 1.96
    P = np.diag([1e-8, 1e-8, 1e-6, std**2])
    return Estimate(
        0.0, s, axis, CHI, std**2, 0.0, covariance=P, image_covariance=IMAGES, extrapolated_s=0.0
    )


def servo(around: AroundTarget | None) -> ServoController:
    return ServoController(TASK, SPEED, SHARE, around)


def around(
    prefer: FloatArray | None = None, walls: tuple[FloatArray, FloatArray] | None = None
) -> AroundTarget:
    return AroundTarget(np.array([0.0, 0.0, 1.0]) if prefer is None else prefer, lambda: walls)


def s_dot(s: FloatArray, axis: FloatArray | None, twist: FloatArray) -> FloatArray:
    """Equations (12) and (20)."""
    v = twist[:3] if axis is None else twist[:3] - axis * (axis @ twist[:3])
    return np.asarray(-CHI * v - np.cross(twist[3:], s))


def cases() -> list[tuple[FloatArray, FloatArray | None]]:
    rng = np.random.default_rng(5)
    out: list[tuple[FloatArray, FloatArray | None]] = []
    for axis in (None, AXIS):
        for _ in range(5):
            s = np.array([0.0, 0.0, 13.0]) + rng.normal(0.0, 2.0, 3)
            out.append((s if axis is None else s - axis * (axis @ s), axis))
    return out


@pytest.mark.parametrize(("s", "axis"), cases())
def test_moving_around_the_target_does_not_disturb_the_task(
    s: FloatArray, axis: FloatArray | None
) -> None:
    estimate = known(s, axis, 0.1)
    twists = []
    for spare in (around(), None):
        # Far from saturation, and with time to take up speed.
        controller = ServoController(TASK, SPEED, SHARE, spare, 1e-3, 0.2)
        twists.append(controller.twist(estimate, 1.0))
    curious, plain = twists
    assert np.linalg.norm(curious[:3]) > 0.9 * SPEED > 10.0 * np.linalg.norm(plain[:3])
    np.testing.assert_allclose(s_dot(s, axis, curious), s_dot(s, axis, plain), atol=1e-12)
    if axis is not None:
        assert abs(curious[:3] @ axis) < 1e-12


@pytest.mark.parametrize("axis", [None, AXIS])
def test_the_target_comes_to_its_place_whatever_the_camera_does_around_it(
    axis: FloatArray | None,
) -> None:
    s = np.array([-3.0, 2.0, 20.0])
    if axis is not None:
        s -= axis * (axis @ s)
    controller, dt_s = servo(around()), 0.01
    for _ in range(800):
        twist = controller.twist(known(s, axis, 0.1), dt_s)
        assert np.linalg.norm(twist[:3]) < SPEED * (1.0 + 1e-9)
        s = s + dt_s * s_dot(s, axis, twist)
        if axis is not None:
            axis = axis - dt_s * np.cross(twist[3:], axis)
            axis = axis / np.linalg.norm(axis)
            s = s - axis * (axis @ s)
    estimate = known(s, axis, 0.1)
    assert controller.arrived(estimate)
    assert TASK.off_px(estimate) < 1.0 and abs(TASK.off_m(estimate) or 1.0) < 5e-4
    assert np.linalg.norm(twist[:3]) > 0.9 * SPEED  # still curious


def test_curiosity_ends_when_the_radius_is_known_and_not_before() -> None:
    speeds = []
    for share in (1.0, SHARE, 0.75 * SHARE, 0.5 * SHARE, 0.1 * SHARE):
        twist = servo(around()).twist(known(THERE, None, share), 1.0)
        speeds.append(float(np.linalg.norm(twist[:3])) / SPEED)
    assert speeds[0] == pytest.approx(1.0) and speeds[1] > 0.98
    assert 0.4 < speeds[2] < 0.6
    assert max(speeds[3:]) < 0.01


def test_while_the_radius_is_unknown_the_task_does_not_take_all_the_speed() -> None:
    far = known(3.0 * THERE, None, 1.0)
    v = servo(around()).twist(far, 1.0)[:3]
    assert float(v @ BEARING) == pytest.approx(SPEED / math.sqrt(2.0))
    assert float(np.linalg.norm(v)) == pytest.approx(SPEED)
    v = servo(around()).twist(known(3.0 * THERE, None, 1e-6), 1.0)[:3]
    np.testing.assert_allclose(v, SPEED * BEARING, atol=1e-12)


def test_it_goes_around_by_a_way_that_no_wall_is_in() -> None:
    normals = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    rooms_m = np.array([0.001, 0.5])
    estimate = known(np.array([0.0, 0.0, 13.5]), None, 1.0)
    turned = servo(around(np.array([SPEED, 0.0, 0.0]), (normals, rooms_m)))
    v = turned.twist(estimate, 1.0)[:3]
    assert v[0] * 0.75 <= 0.001


def test_speed_across_changes_at_a_bounded_rate() -> None:
    controller = servo(around())
    before = controller.twist(known(THERE, None, 1.0), 0.01)[:3]
    assert np.linalg.norm(before) <= 0.01 + 1e-6
    for _ in range(20):
        before = controller.twist(known(THERE, None, 1.0), 0.01)[:3]
    after = controller.twist(known(THERE, None, 1e-9), 0.01)[:3]
    assert np.linalg.norm(after - before) <= 0.01 + 1e-6


def test_before_the_radius_is_positive_only_the_image_is_controlled() -> None:
    lost = Estimate(0.0, THERE, None, -1.0, None, 0.0)
    assert TASK.off_m(lost) is None and not TASK.done(lost)
    assert servo(None).status(lost) == "0.0 px, –"
    np.testing.assert_allclose(servo(None).twist(lost, 0.01), np.zeros(6), atol=1e-12)


def test_a_task_must_make_sense() -> None:
    for bearing in ([0.0, 0.0, 2.0], [0.0, 0.0, -1.0]):
        with pytest.raises(ValueError, match="bearing"):
            ServoTask(np.array(bearing), 0.25, 800.0, 2.0, 0.001)
    with pytest.raises(ValueError, match="positive"):
        ServoTask(BEARING, 0.0, 800.0, 2.0, 0.001)
    with pytest.raises(ValueError, match="positive"):
        ServoController(TASK, SPEED, 0.0, None)
