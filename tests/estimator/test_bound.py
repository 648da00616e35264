"""The Cramér-Rao bound, and how near the filter and least squares come to it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.batch import BatchLeastSquares
from estimator.bound import cramer_rao
from estimator.kalman import RadiusPrior
from estimator.twist_history import TwistHistory
from tests.estimator.exact_motion import BALL, Target, lively
from tests.estimator.noisy_images import TWIST, NoisyArm, estimates, guessed, noisy
from tests.estimator.responses import EXACT, MOTION, REGULAR, TARGETS, model_of

FloatArray = NDArray[np.float64]

STAMPS = REGULAR[REGULAR < 1.0]
NOISE_PX = 0.02


def bound(target: Target, stamps: FloatArray, motion: TwistHistory) -> FloatArray:
    rng = np.random.default_rng(0)
    features = [noisy(MOTION.feature(target, t_s), NOISE_PX, rng) for t_s in stamps]
    return cramer_rao(stamps, features, 1.0 / target.radius_m, motion)


@pytest.mark.parametrize("target", TARGETS)
def test_with_an_exact_arm_it_is_what_least_squares_states(target: Target) -> None:
    rng = np.random.default_rng(0)
    vague = RadiusPrior(target.radius_m, target.radius_m / 100.0, 100.0 * target.radius_m)
    fit = BatchLeastSquares(model_of(target), vague)
    for t_s in STAMPS:
        fit.correct(noisy(MOTION.feature(target, t_s), NOISE_PX, rng), t_s, EXACT)
    assert fit.estimate is not None and fit.estimate.variance is not None
    least = bound(target, STAMPS, EXACT)[-1]
    # What least squares states is widened by residuals that happen to be large, never narrowed.
    assert 0.999 * least <= np.sqrt(fit.estimate.variance) <= 1.3 * least


def test_noise_of_the_arm_raises_it_and_images_lower_it() -> None:
    exact = bound(BALL, STAMPS, EXACT)
    noisy_arm = NoisyArm(lively(0.05, 0.3), 1.0).history(np.random.default_rng(1))
    noisy_arm.covariance = TWIST.covariance
    assert bound(BALL, STAMPS, noisy_arm)[-1] > 1.05 * exact[-1]
    assert np.all(np.diff(exact) < 1e-9 * exact[:-1])


def test_the_filter_errs_by_at_most_a_fifth_more() -> None:
    arm = NoisyArm(lively(0.05, 0.3), 1.0)
    history = arm.history(np.random.default_rng(2))
    history.covariance = TWIST.covariance
    least = bound(BALL, STAMPS, history)[-1]
    exact = [MOTION.feature(BALL, t_s) for t_s in STAMPS]
    errors = []
    for seed in range(100):
        *_, last = estimates(guessed(BALL), STAMPS, exact, arm, NOISE_PX, seed)
        errors.append(last.chi - 1.0 / BALL.radius_m)
    assert np.sqrt(np.mean(np.square(errors))) <= 1.2 * least
