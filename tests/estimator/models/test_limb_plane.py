"""The limb plane (7): moments and their rates as exact projections have them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.estimate import Estimate
from estimator.extended import ExtendedKalmanFilter
from estimator.flow import integrate
from estimator.kalman import KalmanFilter, RadiusPrior, TwistNoise
from estimator.models.limb_plane import LimbPlane, moments_of
from estimator.models.sphere import Sphere
from estimator.observer import Observer
from tests.estimator.exact_motion import BALL, PIPE
from tests.estimator.noisy_images import noisy
from tests.estimator.responses import EXACT, MOTION, REGULAR

FloatArray = NDArray[np.float64]

S = np.array([1.7, -0.9, 9.0])
PRIOR = RadiusPrior(1.5 * BALL.radius_m, 0.5 * BALL.radius_m, 4.5 * BALL.radius_m)


def at(t_s: float) -> tuple[FloatArray, FloatArray]:
    """The true s (5,) and χ (3,)."""
    s = MOTION.feature(BALL, t_s).s
    return moments_of(s), s / (BALL.radius_m * (s @ s - 1.0))


def test_moments_are_those_of_the_drawn_outline() -> None:
    grid = np.linspace(-0.2, 0.45, 3001)
    x, y = np.meshgrid(grid, grid - 0.2)
    rays = np.stack([x, y, np.ones_like(x)])
    norm = np.linalg.norm(S)
    along = np.tensordot(S, rays, 1) / np.linalg.norm(rays, axis=0)
    inside = along > np.sqrt(norm**2 - 1.0)
    x, y = x[inside], y[inside]
    dx, dy = x - x.mean(), y - y.mean()
    drawn = [x.mean(), y.mean(), np.mean(dx * dx), np.mean(dx * dy), np.mean(dy * dy)]
    np.testing.assert_allclose(moments_of(S), drawn, rtol=2e-3, atol=2e-6)


def test_s_and_the_radius_are_found_again_in_the_moments() -> None:
    model, s = LimbPlane(), moments_of(S)
    np.testing.assert_allclose(model.position_and_axis(s)[0], S, rtol=1e-9)
    chi = model.chi_of_guess(s, 0.03)
    assert model.inverse_radius(s, chi) == pytest.approx(1.0 / 0.03, rel=1e-9)
    P0 = 0.03 * S
    np.testing.assert_allclose(chi, P0 / (P0 @ P0 - 0.03**2), rtol=1e-9)


@pytest.mark.parametrize("duration_s", [0.05, 1.5])
def test_integrated_along_a_motion_they_arrive_where_the_sphere_is_seen(duration_s: float) -> None:
    s0, chi0 = at(0.4)
    window = EXACT.window(0.4, 0.4 + duration_s)
    s, chi = integrate(LimbPlane(), s0[None], chi0[None], window.times_s, window.twists_camera)
    s_end, chi_end = at(0.4 + duration_s)
    np.testing.assert_allclose(s[0, -1], s_end, atol=3e-6)
    np.testing.assert_allclose(chi[0, -1], chi_end, rtol=2e-4, atol=1e-4)


def test_a_cylinder_and_a_sphere_around_the_camera_are_refused() -> None:
    with pytest.raises(ValueError, match="sphere"):
        LimbPlane().measured(MOTION.feature(PIPE, 0.0), None)
    with pytest.raises(ValueError, match="no ellipse"):
        moments_of(np.array([3.0, 0.0, 0.5]))


def test_the_observer_on_three_unknowns_approaches_the_radius() -> None:
    observer = Observer(LimbPlane(), 2e4, 1.0, 1.5 * BALL.radius_m)
    for t_s in REGULAR[:100]:
        observer.correct(MOTION.feature(BALL, t_s), t_s, EXACT)
    assert observer.estimate is not None
    assert abs(observer.estimate.chi * BALL.radius_m - 1.0) < 0.15  # it began with 0.33


def driven(kalman: KalmanFilter | ExtendedKalmanFilter, count: int = 40) -> Estimate:
    rng = np.random.default_rng(2)
    for t_s in REGULAR[10 : 10 + count]:
        kalman.correct(noisy(MOTION.feature(BALL, t_s), 0.02, rng), t_s, EXACT)
    assert kalman.estimate is not None
    return kalman.estimate


def test_with_the_spheres_own_model_the_extended_filter_is_the_linear_one() -> None:
    quiet = TwistNoise(0.0, 0.0)
    linear = driven(KalmanFilter(Sphere(), PRIOR, quiet))
    extended = driven(ExtendedKalmanFilter(Sphere(), PRIOR, quiet))
    assert linear.variance is not None and extended.variance is not None
    assert extended.chi == pytest.approx(linear.chi, abs=0.05 * np.sqrt(linear.variance))
    assert extended.variance <= 1.01 * linear.variance


def test_on_three_unknowns_the_extended_filter_finds_the_radius_too() -> None:
    extended = ExtendedKalmanFilter(LimbPlane(), PRIOR, TwistNoise(0.0, 0.0))
    estimate = driven(extended)
    assert estimate.radius_m == pytest.approx(BALL.radius_m, rel=0.03)
    predicted = extended.predict(2.0, EXACT)
    np.testing.assert_allclose(predicted.s, MOTION.feature(BALL, 2.0).s, rtol=0.02, atol=0.02)
    with pytest.raises(ValueError, match="no image"):
        extended.predict(0.1, EXACT)
