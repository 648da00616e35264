"""Several unknowns at once, also such that change: the observer and the extended filter."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from estimator.active.controller import Controller
from estimator.active.gradient_policy import GradientPolicy
from estimator.active.policy import ConstantVelocity, VelocityPolicy
from estimator.estimate import Estimate, Estimator
from estimator.extended import ExtendedKalmanFilter
from estimator.ideal import ideal_response, rms_vs_ideal
from estimator.image.feature import Feature
from estimator.kalman import KalmanFilter, RadiusPrior, TwistNoise
from estimator.models.bearings import Bearings
from estimator.models.limb_plane import LimbPlane
from estimator.models.model import Model
from estimator.models.points import Points
from estimator.observer import Observer
from tests.estimator.closed_points import drive
from tests.estimator.exact_motion import BALL, Target, Trajectory
from tests.estimator.exact_points import THREE, points_at, seen_points, truth
from tests.estimator.responses import EXACT, MOTION, REGULAR
from tests.estimator.two_balls import A, TwoBalls

FloatArray = NDArray[np.float64]

DEPTHS = RadiusPrior(0.7, 0.3, 2.0)
QUIET = TwistNoise(0.0, 0.0)


@pytest.mark.parametrize("damping", [0.5, 1.0])
def test_constant_unknowns_obey_eq_5_each_in_its_own_coordinate(damping: float) -> None:
    """While v changes the eigenvectors of this Ω Ωᵀ stay, so (5) is exact."""
    second = Target(np.array([0.1, 0.05, 0.35]), 0.03)
    exact = np.linalg.solve(A, [1.0 / BALL.radius_m, 1.0 / second.radius_m])
    observer = Observer(TwoBalls(), 2000.0, damping, 1.5 * BALL.radius_m)
    z = []
    for t_s in REGULAR:
        s = np.concatenate((MOTION.feature(BALL, t_s).s, MOTION.feature(second, t_s).s))
        observer.correct(Feature(s, np.eye(6)), t_s, EXACT)
        assert observer.estimate is not None and observer.estimate.unknowns is not None
        z.append(exact - observer.estimate.unknowns)
    values, U = np.linalg.eigh(A.T @ A)
    eta = np.array(z) @ U
    t_s = np.append(np.arange(0.0, REGULAR[-1], 1e-3), REGULAR[-1])
    square = np.array([float(MOTION.twist(t)[:3] @ MOTION.twist(t)[:3]) for t in t_s])
    for value, column in zip(values, eta.T, strict=True):
        expected = ideal_response(t_s, value * square, 2000.0, damping, column[0], REGULAR)
        assert rms_vs_ideal(REGULAR, column, expected) < 5e-5


def approaching(t_s: float) -> FloatArray:
    """Towards the points and across: χ = 1/Z grows by a third, Ω follows s."""
    ramp = min(t_s / 0.2, 1.0)
    return ramp * np.array([0.05, 0.02 * np.cos(t_s), 0.08, 0.05, 0.1 * np.cos(2.0 * t_s), 0.2])


@pytest.mark.parametrize("model", [Points(1), Bearings(1), Points(3), Bearings(3)])
def test_unknowns_that_move_obey_eq_3(model: Points | Bearings) -> None:
    """χ̇ ≠ 0: the reference is (3) itself, ż = −α w + f_u(χ) − f_u(χ̂), with the true Ω(t)."""
    alpha, points = 3000.0, THREE[: model.p]
    motion = Trajectory(approaching, 2.0)
    p = model.p

    def rate(t_s: float, e: FloatArray) -> FloatArray:
        s, chi = truth(model, points_at(motion, points, t_s))
        u = approaching(t_s)
        sigma2 = (model.Omega(s, u[:3]) ** 2).sum(axis=1)  # Ω Ωᵀ is diagonal
        g = model.f_u(s, chi, u) - model.f_u(s, chi - e[:p], u)
        w_dot = -2.0 * np.sqrt(alpha * sigma2) * e[p:] + sigma2 * e[:p]
        return np.concatenate((-alpha * e[p:] + g, w_dot))

    stamps, history = np.arange(0.0, 2.0, 0.1), motion.history()
    observer = Observer(model, alpha, 1.0, 0.55)
    z = []
    for t_s in stamps:
        P = points_at(motion, points, t_s)
        observer.correct(seen_points(P), t_s, history)
        assert observer.estimate is not None and observer.estimate.unknowns is not None
        z.append(truth(model, P)[1] - observer.estimate.unknowns)
    start = np.concatenate((z[0], np.zeros(p)))
    exact = solve_ivp(rate, (0.0, stamps[-1]), start, t_eval=stamps, rtol=1e-7, atol=1e-10)
    for column, expected in zip(np.array(z).T, exact.y[:p], strict=True):
        assert rms_vs_ideal(stamps, column, expected) < 2e-3


def depth_errors(model: Points | Bearings, estimate: Estimate, P: FloatArray) -> FloatArray:
    """Relative errors (n,) of the depths or ranges."""
    assert estimate.unknowns is not None
    errors: FloatArray = truth(model, P)[1] / estimate.unknowns - 1.0
    return errors


@pytest.mark.parametrize("model", [Points(3), Bearings(3)])
def test_the_active_camera_knows_all_depths_sooner_than_one_that_goes_straight(
    model: Points | Bearings,
) -> None:
    """Starting towards one of the points, whose depth that does not show."""
    v0 = 0.05 * THREE[1] / np.linalg.norm(THREE[1])
    errors = {}
    policies: tuple[VelocityPolicy, ...] = (
        GradientPolicy(model, v0, 10.0, 2.0),
        ConstantVelocity(v0),
    )
    for policy in policies:
        observer = Observer(model, 2e4, 1.0, 0.7)
        P, estimate, speeds = drive(THREE, observer, Controller(policy, 2.0), 4.0)
        np.testing.assert_allclose(speeds, 0.05, rtol=1e-3)
        errors[type(policy)] = np.abs(depth_errors(model, estimate, P)).max()
    assert errors[GradientPolicy] < 1e-4
    assert errors[ConstantVelocity] > 0.02


def extended(model: Points | Bearings) -> Estimator:
    return ExtendedKalmanFilter(model, DEPTHS, QUIET, independent=True)


@pytest.mark.parametrize("model", [Points(3), Bearings(3)])
def test_the_extended_filter_finds_the_depths_of_points(model: Points | Bearings) -> None:
    estimator, rng, std = extended(model), np.random.default_rng(3), 1e-4
    for t_s in REGULAR[10:70]:
        exact = seen_points(points_at(MOTION, THREE, t_s), std)
        noisy = Feature(exact.s + std * rng.standard_normal(6), exact.covariance)
        estimator.correct(noisy, t_s, EXACT)
    estimate = estimator.estimate
    assert estimate is not None and estimate.variance is not None
    P = points_at(MOTION, THREE, float(REGULAR[69]))
    assert np.abs(depth_errors(model, estimate, P)).max() < 5e-3
    assert abs(estimate.chi - truth(model, P)[1][0]) < 3.0 * np.sqrt(estimate.variance)
    predicted = estimator.predict(3.0, EXACT)
    assert predicted.state is not None
    s, _ = truth(model, points_at(MOTION, THREE, 3.0))
    np.testing.assert_allclose(predicted.state, s, atol=2e-3)


def test_the_extended_filter_says_how_sure_it_is_of_a_depth() -> None:
    """Over 60 seeds the normalised error squared of the first 1/Z has the mean it should."""
    model, std, squares = Points(2), 3e-4, []
    stamps = REGULAR[15:27]
    exact = [seen_points(points_at(MOTION, THREE[:2], t), std) for t in stamps]
    chi = truth(model, points_at(MOTION, THREE[:2], float(stamps[-1])))[1][0]
    for seed in range(60):
        rng = np.random.default_rng(seed)
        estimator = extended(model)
        for t_s, feature in zip(stamps, exact, strict=True):
            s = feature.s + std * rng.standard_normal(4)
            estimator.correct(Feature(s, feature.covariance), float(t_s), EXACT)
        estimate = estimator.estimate
        assert estimate is not None and estimate.variance is not None
        squares.append((estimate.chi - chi) ** 2 / estimate.variance)
    assert 0.7 < np.mean(squares) < 1.4  # 95 % of such means of 60 are within 0.67 and 1.39


@pytest.mark.parametrize("model", [Points(1), Bearings(1), LimbPlane(), TwoBalls()])
def test_the_exact_filter_refuses_unknowns_it_is_not_exact_for(model: Model) -> None:
    with pytest.raises(ValueError, match="ExtendedKalmanFilter"):
        KalmanFilter(model, DEPTHS, QUIET)
