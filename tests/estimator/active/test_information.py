"""The velocity that makes the radius known soonest: what it is worth, chosen, and kept inside."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.active.circle import CircularVelocity
from estimator.active.information import (
    directions_across,
    sphere_directions,
    variance_decrease,
)
from estimator.active.information_policy import InformationPolicy
from estimator.estimate import Estimate
from estimator.kalman_step import moved, seen

FloatArray = NDArray[np.float64]

SPEED = 0.05
S = np.array([0.3, -0.2, 14.0])
CHI = 52.0
# Along the line of sight the images are 14 times less certain than across it.
IMAGES = np.diag([1e-4, 1e-4, 14e-4]) ** 2
WIDE = np.diag([1e-4, 1e-4, 14e-4, 20.0]) ** 2
AXIS = np.array([0.6, 0.8, 0.0])
NEAR_M = 0.05


def estimate(
    covariance: FloatArray | None = WIDE, axis: FloatArray | None = None, s: FloatArray = S
) -> Estimate:
    return Estimate(0.0, s, axis, CHI, None, 0.0, covariance=covariance, image_covariance=IMAGES)


def chosen(policy: InformationPolicy, known: Estimate) -> FloatArray:
    """The velocity after a second with the same knowledge."""
    for _ in range(100):
        policy.inform(known)
        policy.advance(known.axis, np.zeros(3), 0.01)
    assert np.linalg.norm(policy.v) == pytest.approx(SPEED, rel=1e-9)
    return policy.v


def test_what_a_displacement_is_worth_is_what_the_filter_makes_of_it() -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(4, 4)) * [1e-3, 1e-3, 1e-2, 5.0]
    P = root.T @ root
    shifts = rng.normal(0.0, 0.02, (5, 3))
    none = np.zeros(3)
    for shift, decrease in zip(shifts, variance_decrease(P, IMAGES, shifts), strict=True):
        x, after = moved(np.append(S, CHI), P, np.eye(3), shift, none, np.zeros((6, 6)), 0.5, 1e-3)
        _, known, _ = seen(x, after, S, IMAGES, none)
        assert decrease == pytest.approx(P[3, 3] - known[3, 3], rel=1e-3)


def test_directions_are_spread_evenly() -> None:
    directions = sphere_directions(60)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.abs(directions.mean(axis=0)).max() < 0.02
    assert (directions @ directions.T - 2.0 * np.eye(60)).max() < np.cos(0.3)


@pytest.mark.parametrize("axis", [None, AXIS])
def test_directions_across_are_across_sight_and_axis(axis: FloatArray | None) -> None:
    directions = directions_across(S, axis)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    np.testing.assert_allclose(directions @ S, 0.0, atol=1e-12)
    np.testing.assert_allclose(directions.sum(axis=0), 0.0, atol=1e-12)
    if axis is None:
        assert len(directions) > 8
    else:
        np.testing.assert_allclose(directions @ axis, 0.0, atol=1e-12)


def test_of_ways_as_good_the_first_is_across_that_of_centring() -> None:
    # Images of a target that moves in the image are uncertain that way, as their instants are.
    beside = np.array([1.5, -1.0, 14.0])
    for sign in (-1.0, 1.0):  # on the side that it was to go to anyway
        policy = InformationPolicy([sign * SPEED, 0.0, 0.0], NEAR_M)
        policy.inform(estimate(s=beside))
        assert abs(policy.v @ beside) < 1e-9
        assert abs(policy.v[:2] @ beside[:2]) < 1e-9
        assert sign * policy.v[0] > 0.0


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_on_a_cylinder_the_first_way_is_the_one_with_the_lesser_turn(sign: float) -> None:
    beside = sign * np.array([0.8, -0.6, 0.0]) + [0.0, 0.0, 14.0]
    policy = InformationPolicy([0.0, 0.0, SPEED], NEAR_M)
    policy.inform(estimate(axis=AXIS, s=beside))
    assert policy.v[:2] @ beside[:2] > 0.9 * SPEED


@pytest.mark.parametrize("v0", [[0.0, 0.0, SPEED], [0.0, 0.0, -SPEED], [SPEED, 0.0, 0.0]])
def test_the_camera_goes_across_the_line_of_sight(v0: list[float]) -> None:
    v = chosen(InformationPolicy(v0, NEAR_M), estimate())
    assert abs(v[2]) < 0.2 * SPEED


def test_on_a_cylinder_it_goes_across_the_axis_too() -> None:
    v = chosen(
        InformationPolicy(SPEED * AXIS, NEAR_M), estimate(axis=AXIS, s=S - AXIS * (AXIS @ S))
    )
    assert abs(v @ AXIS) < 0.2 * SPEED
    assert abs(v[2]) < 0.25 * SPEED


def test_a_direction_once_chosen_is_not_given_up_for_one_as_good() -> None:
    policy = InformationPolicy([SPEED, 0.0, 0.0], NEAR_M)
    first = chosen(policy, estimate())
    np.testing.assert_allclose(chosen(policy, estimate()), first)


def test_without_a_covariance_the_velocity_stays() -> None:
    policy = InformationPolicy([0.0, 0.0, SPEED], NEAR_M)
    np.testing.assert_allclose(chosen(policy, estimate(covariance=None)), [0.0, 0.0, SPEED])


def test_it_stays_inside_walls_and_bends_away_at_a_bounded_rate() -> None:
    normals = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    rooms_m = np.array([0.5, 0.5, 0.5])
    policy = InformationPolicy([0.0, SPEED, 0.0], NEAR_M, walls=lambda: (normals, rooms_m))
    policy.inform(estimate())
    rooms_m[:] = [0.01, 0.01, 0.01]  # only −y is left of what is across the line of sight
    before = policy.v
    policy.inform(estimate())
    policy.advance(None, np.zeros(3), 0.01)
    turned = np.arccos(np.clip(before @ policy.v / SPEED**2, -1.0, 1.0))
    assert turned <= 0.031
    v = chosen(policy, estimate())
    assert v[1] < 0.0 and np.all(1.5 * 0.5 * normals @ v <= np.maximum(rooms_m, 0.0) + 1e-9)


@pytest.mark.parametrize(("least_m", "most_m", "sign"), [(0.26, 1.0, -1.0), (0.01, 0.2, 1.0)])
def test_from_too_near_it_goes_away_and_from_too_far_nearer(
    least_m: float, most_m: float, sign: float
) -> None:
    # Noise that would send it along the line of sight, one way or the other.
    odd = Estimate(
        0.0, S, None, CHI, None, 0.0, covariance=WIDE, image_covariance=IMAGES[::-1, ::-1].copy()
    )
    policy = InformationPolicy([0.0, 0.0, -sign * SPEED], least_m, most_m)
    target_m = S / CHI
    then_m = np.linalg.norm(target_m - 0.5 * chosen(policy, odd))
    assert sign * (np.linalg.norm(target_m) - then_m) > 0.0


def test_a_circle_returns_to_where_it_began() -> None:
    policy = CircularVelocity([0.03, 0.04, 0.0], 0.02)
    np.testing.assert_allclose(policy.v, [0.03, 0.04, 0.0])
    count, round_s = 1000, 2.0 * np.pi * 0.02 / 0.05
    way = np.zeros((count, 3))
    for k in range(count):
        way[k] = policy.v * round_s / count
        policy.advance(None, np.zeros(3), round_s / count)
    track = np.cumsum(way, axis=0)
    np.testing.assert_allclose(track[-1], 0.0, atol=1e-6)
    assert np.ptp(track[:, 0]) == pytest.approx(0.04, rel=1e-3)


@pytest.mark.parametrize("v0", [[0.0, 0.0, 0.0], [0.05, 0.0], [np.inf, 0.0, 0.0]])
def test_policies_need_a_velocity(v0: list[float]) -> None:
    with pytest.raises(ValueError, match="velocity"):
        InformationPolicy(v0, NEAR_M)
    with pytest.raises(ValueError, match="velocity"):
        CircularVelocity(v0, 0.02)
