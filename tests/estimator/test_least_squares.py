"""The estimators for comparison: least squares over the whole run, and triangulation."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.batch import BatchLeastSquares
from estimator.estimate import Correction, Estimator
from estimator.image.feature import Feature
from estimator.kalman import KalmanFilter, RadiusPrior, TwistNoise
from estimator.triangulation import Triangulation
from estimator.twist_history import MotionUnknownError
from tests.estimator.exact_motion import BALL, Target
from tests.estimator.noisy_images import noisy
from tests.estimator.responses import EXACT, MOTION, REGULAR, TARGETS, model_of

FloatArray = NDArray[np.float64]
Make = Callable[[Target], Estimator]


def prior(target: Target) -> RadiusPrior:
    guess_m = 1.5 * target.radius_m
    return RadiusPrior(guess_m, guess_m / 3.0, guess_m * 3.0)


def batch(target: Target) -> Estimator:
    return BatchLeastSquares(model_of(target), prior(target))


def triangulation(target: Target) -> Estimator:
    return Triangulation(model_of(target), 1.5 * target.radius_m)


def at(target: Target, t_s: float) -> Feature:
    exact = MOTION.feature(target, t_s)
    return Feature(exact.s, 1e-8 * np.eye(3), exact.axis)


@pytest.mark.parametrize("make", [batch, triangulation])
@pytest.mark.parametrize("target", TARGETS)
def test_from_exact_images_the_radius_is_exact(make: Make, target: Target) -> None:
    estimator = make(target)
    for t_s in REGULAR[:90]:
        estimator.correct(at(target, t_s), t_s, EXACT)
    estimate = estimator.estimate
    assert estimate is not None
    assert estimate.radius_m == pytest.approx(target.radius_m, rel=2e-5)
    predicted, truth = estimator.predict(3.1, EXACT), MOTION.feature(target, 3.1)
    np.testing.assert_allclose(predicted.s, truth.s, atol=1e-3)
    if truth.axis is not None:
        np.testing.assert_allclose(predicted.axis, truth.axis, atol=1e-5)


@pytest.mark.parametrize("make", [batch, triangulation])
def test_the_first_image_leaves_the_guess_and_late_ones_change_nothing(make: Make) -> None:
    estimator = make(BALL)
    with pytest.raises(ValueError, match="no image"):
        estimator.predict(0.0, EXACT)
    assert estimator.correct(at(BALL, 0.5), 0.5, EXACT) is Correction.INITIALISED
    assert estimator.estimate is not None
    assert estimator.estimate.radius_m == pytest.approx(1.5 * BALL.radius_m)
    assert estimator.correct(at(BALL, 0.4), 0.4, EXACT) is Correction.STALE
    with pytest.raises(MotionUnknownError):
        estimator.correct(at(BALL, 4.0), 4.5, EXACT)
    assert estimator.correct(at(BALL, 0.6), 0.6, EXACT) is Correction.APPLIED


@pytest.mark.parametrize("target", TARGETS)
def test_with_an_exact_arm_least_squares_and_the_filter_agree(target: Target) -> None:
    rng = np.random.default_rng(3)
    kalman = KalmanFilter(model_of(target), prior(target), TwistNoise(0.0, 0.0))
    fitted = batch(target)
    for t_s in REGULAR[10:55]:  # from where the camera is under way
        feature = noisy(MOTION.feature(target, t_s), 0.02, rng)
        kalman.correct(feature, t_s, EXACT)
        fitted.correct(feature, t_s, EXACT)
    one, other = kalman.estimate, fitted.estimate
    assert one is not None and other is not None
    assert one.variance is not None and other.variance is not None
    assert other.chi == pytest.approx(one.chi, abs=0.1 * np.sqrt(one.variance))
    assert other.variance == pytest.approx(one.variance, rel=0.3)
