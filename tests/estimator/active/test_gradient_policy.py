"""(24) for any model: the norm is kept and the least of several σ_i² climbs to its maximum."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.active.gradient_policy import GradientPolicy
from estimator.active.information import sphere_directions
from estimator.active.policy import InformedPolicy, PaperPolicy
from estimator.active.sigma2 import J_a
from estimator.estimate import Estimate
from estimator.models.bearings import Bearings
from estimator.models.cylinder import Cylinder
from estimator.models.limb_plane import LimbPlane, moments_of
from estimator.models.model import Model
from estimator.models.points import Points
from tests.estimator.exact_points import THREE, truth

FloatArray = NDArray[np.float64]

AXIS = np.array([0.35, 0.9, 0.2]) / np.linalg.norm([0.35, 0.9, 0.2])
SPEED = 0.07
STILL = np.zeros(3)


def informed(
    model: Model, s: FloatArray, chi: FloatArray, v0: FloatArray, k2: float = 1.0
) -> GradientPolicy:
    policy = GradientPolicy(model, v0, 10.0, k2)
    policy.inform(Estimate(0.0, s[:3], None, 1.0, None, 0.0, state=s, unknowns=chi))
    return policy


def least(model: Model, s: FloatArray, v: FloatArray) -> float:
    return float(np.linalg.svd(model.Omega(s, v), compute_uv=False)[-1] ** 2)


def test_on_a_cylinder_it_is_the_papers_law_but_for_a_rise_that_comes_by_itself() -> None:
    rng = np.random.default_rng(4)
    for _ in range(10):
        s = np.concatenate((rng.standard_normal(3), rng.standard_normal(3)))
        s[3:] /= np.linalg.norm(s[3:])
        v, omega = rng.standard_normal((2, 3)) * [[0.05], [0.3]]
        paper = PaperPolicy([0.0, 0.0, 0.07], 10.0, 1.3)
        policy = informed(Cylinder(), s, np.array([25.0]), np.array([0.0, 0.0, 0.07]), 1.3)
        # What turns the axis so that σ² rises is not undone.
        falls = J_a(v, s[3:]) @ np.cross(s[3:], omega) < 0.0
        expected = paper.v_dot(v, s[3:], omega if falls else STILL)
        np.testing.assert_allclose(policy.v_dot(v, omega), expected, rtol=1e-7, atol=1e-10)


LIMB_S = moments_of(np.array([2.7, -1.9, 6.0]))
CASES = [
    pytest.param(Points(1), truth(Points(1), THREE[:1])[0], 1.0, id="one point"),
    pytest.param(Points(3), truth(Points(3), THREE)[0], 1.0, id="points"),
    pytest.param(Bearings(3), truth(Bearings(3), THREE)[0], 1.0, id="bearings"),
    # Its σ1² is a thousandth of the others', so the gain has to be as much larger.
    pytest.param(LimbPlane(), LIMB_S, 1000.0, id="limb plane"),
]
DIRECTIONS = sphere_directions(200)


@pytest.mark.parametrize("v0", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, -1.0, 0.0)])
@pytest.mark.parametrize(("model", "s", "k2"), CASES)
def test_the_least_sigma2_climbs_to_where_no_direction_near_is_better(
    model: Model, s: FloatArray, k2: float, v0: tuple[float, ...]
) -> None:
    start = SPEED * np.array(v0)
    policy = informed(model, s, np.zeros(model.p), start, k2)
    for _ in range(300):
        policy.advance(None, STILL, 0.04)
    assert np.linalg.norm(policy.v) == pytest.approx(SPEED, rel=1e-3)
    near = policy.v + 0.05 * SPEED * DIRECTIONS
    near *= SPEED / np.linalg.norm(near, axis=1, keepdims=True)
    best = max(least(model, s, v) for v in near)
    assert least(model, s, policy.v) > 0.97 * best
    assert least(model, s, policy.v) > 0.97 * least(model, s, start)


def test_a_gain_too_large_for_the_tick_is_followed_as_far_as_it_can_be() -> None:
    model = Points(3)
    s, chi = truth(model, THREE)
    policy = GradientPolicy(model, SPEED * np.array([0.0, 0.0, 1.0]), 1e5, 1e6)
    policy.inform(Estimate(0.0, s[:3], None, 1.0, None, 0.0, state=s, unknowns=chi))
    for _ in range(30):
        policy.advance(None, np.array([0.3, 0.0, 0.0]), 0.02)
        assert np.linalg.norm(policy.v) == pytest.approx(SPEED, rel=0.05)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_straight_at_a_point_it_finds_its_way_out_always_the_same_way(sign: float) -> None:
    model = Points(1)
    s, _ = truth(model, THREE[1:2])
    towards = sign * SPEED * THREE[1] / np.linalg.norm(THREE[1])
    assert least(model, s, towards) < 1e-18
    first, second = (informed(model, s, np.zeros(1), towards) for _ in range(2))
    for _ in range(150):
        first.advance(None, STILL, 0.04)
        second.advance(None, STILL, 0.04)
    np.testing.assert_array_equal(first.v, second.v)
    assert least(model, s, first.v) > 0.99 * (1.0 + s @ s) * SPEED**2


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_the_image_takes_from_sigma2_is_compensated(sign: float) -> None:
    model = Points(1)
    s, chi = truth(model, THREE[1:2])
    v, omega = np.array([0.03, 0.02, 0.06]), sign * np.array([0.2, -0.3, 0.1])
    u = np.concatenate((v, omega))
    s_dot = model.f_m(s, u) + model.Omega(s, v).T @ chi
    h = 1e-5
    drift = (least(model, s + h * s_dot, v) - least(model, s - h * s_dot, v)) / (2 * h)
    with_drift = informed(model, s, chi, v).v_dot(v, omega)
    without = informed(model, s, np.zeros(1), v).v_dot(v, STILL)
    s_dot_0 = model.f_m(s, np.concatenate((v, STILL)))
    np.testing.assert_allclose(s_dot_0, 0.0)
    J_v = np.array(
        [(least(model, s, v + e) - least(model, s, v - e)) / 2e-6 for e in 1e-6 * np.eye(3)]
    )
    across = np.eye(3) - np.outer(v, v) / (v @ v)
    assert np.sign(drift) == -sign
    undone = -across @ J_v * min(drift, 0.0) / (J_v @ J_v)
    np.testing.assert_allclose(with_drift - without, undone, rtol=1e-5, atol=1e-9)


def test_without_k2_or_an_estimate_the_velocity_stays() -> None:
    model = Points(3)
    s, chi = truth(model, THREE)
    v0 = np.array([0.03, 0.02, 0.06])
    policy = informed(model, s, chi, v0, k2=0.0)
    policy.advance(None, STILL, 1.0)
    np.testing.assert_allclose(policy.v, v0, rtol=1e-12)
    blind = GradientPolicy(model, v0, 10.0, 1.0)
    blind.inform(Estimate(0.0, np.ones(3), None, 1.0, None, 0.0))
    blind.advance(None, STILL, 1.0)
    np.testing.assert_array_equal(blind.v, v0)
    assert isinstance(blind, InformedPolicy)
    with pytest.raises(ValueError, match="no state"):
        blind.v_dot(v0, STILL)


@pytest.mark.parametrize("v0", [[0.0, 0.0, 0.0], [np.inf, 0.0, 0.0]])
def test_nonsense_is_refused(v0: list[float]) -> None:
    with pytest.raises(ValueError, match="not zero"):
        GradientPolicy(Points(1), v0, 10.0, 1.0)
    with pytest.raises(ValueError, match="negative"):
        GradientPolicy(Points(1), [0.1, 0.0, 0.0], 10.0, -1.0)
