"""The Kalman filter: exact between images, honest about how sure it is, hard to mislead."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.estimate import Correction
from estimator.image.feature import Feature
from estimator.kalman import KalmanFilter, RadiusPrior, TwistNoise
from estimator.twist_history import MotionUnknownError
from tests.estimator.exact_motion import BALL, Target
from tests.estimator.responses import EXACT, MOTION, REGULAR, TARGETS, irregular, model_of

FloatArray = NDArray[np.float64]

FINE = 1e-8 * np.eye(3)
QUIET = TwistNoise(0.0, 0.0)


def wide(target: Target, guess: float = 1.5) -> RadiusPrior:
    """A guess that is off by the factor ``guess``."""
    guess_m = guess * target.radius_m
    return RadiusPrior(guess_m, guess_m / 3.0, guess_m * 3.0)


def filter_of(target: Target, guess: float = 1.5) -> KalmanFilter:
    return KalmanFilter(model_of(target), wide(target, guess), QUIET)


def at(target: Target, t_s: float, axis_sign: float = 1.0) -> Feature:
    exact = MOTION.feature(target, t_s)
    return Feature(exact.s, FINE, None if exact.axis is None else axis_sign * exact.axis)


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("guess", [0.5, 1.5])
@pytest.mark.parametrize("stamps", [REGULAR, irregular(4)], ids=["regular", "irregular"])
def test_from_exact_images_the_radius_is_exact_whatever_the_guess(
    target: Target, guess: float, stamps: FloatArray
) -> None:
    kalman = filter_of(target, guess)
    for t_s in stamps:
        kalman.correct(at(target, t_s), t_s, EXACT)
    estimate = kalman.estimate
    assert estimate is not None
    assert estimate.radius_m == pytest.approx(target.radius_m, rel=1e-5)
    assert estimate.doubt == ""
    np.testing.assert_allclose(estimate.s, MOTION.feature(target, stamps[-1]).s, atol=1e-4)


@pytest.mark.parametrize("target", TARGETS)
def test_a_prediction_is_where_the_target_will_be_seen_and_changes_nothing(target: Target) -> None:
    kalman = filter_of(target)
    for t_s in REGULAR[:60]:
        kalman.correct(at(target, t_s), t_s, EXACT)
    before = kalman.estimate
    predicted = kalman.predict(2.4, EXACT)
    truth = MOTION.feature(target, 2.4)
    np.testing.assert_allclose(predicted.s, truth.s, atol=2e-3)
    if truth.axis is not None:
        assert predicted.axis is not None
        np.testing.assert_allclose(predicted.axis, truth.axis, atol=1e-5)
    after = kalman.estimate
    assert before is not None and after is not None
    assert (after.t_s, after.chi, after.variance) == (before.t_s, before.chi, before.variance)


def test_an_axis_that_points_the_other_way_is_the_same_axis() -> None:
    target = TARGETS[1].values[0]
    assert isinstance(target, Target)
    one, other = filter_of(target), filter_of(target)
    for k, t_s in enumerate(REGULAR):
        one.correct(at(target, t_s), t_s, EXACT)
        other.correct(at(target, t_s, -1.0 if k % 3 else 1.0), t_s, EXACT)
    assert one.estimate is not None and other.estimate is not None
    assert other.estimate.chi == pytest.approx(one.estimate.chi, rel=1e-12)


@pytest.mark.parametrize("target", TARGETS)
def test_an_outlier_is_ignored_and_counted_out(target: Target) -> None:
    kalman = filter_of(target)
    for k, t_s in enumerate(REGULAR):
        feature = at(target, t_s)
        if k in (40, 70, 71):
            feature = Feature(feature.s * 1.02, feature.covariance, feature.axis)
            assert kalman.correct(feature, t_s, EXACT) is Correction.REJECTED
        else:
            kalman.correct(feature, t_s, EXACT)
    assert kalman.estimate is not None
    assert kalman.estimate.radius_m == pytest.approx(target.radius_m, rel=1e-4)
    assert kalman.estimate.doubt == ""


def test_late_images_and_unknown_motion_leave_the_state_as_it_was() -> None:
    kalman = filter_of(BALL)
    for t_s in REGULAR[:10]:
        kalman.correct(at(BALL, t_s), t_s, EXACT)
    before = kalman.estimate
    assert kalman.correct(at(BALL, 0.1), 0.1, EXACT) is Correction.STALE
    with pytest.raises(MotionUnknownError):
        kalman.correct(at(BALL, 3.9), 4.5, EXACT)
    assert kalman.estimate is not None and before is not None
    assert kalman.estimate.chi == before.chi and kalman.estimate.t_s == before.t_s


def test_the_radius_of_a_guess_has_an_interval_that_is_never_negative() -> None:
    kalman = filter_of(BALL)
    kalman.correct(at(BALL, 0.0), 0.0, EXACT)
    estimate = kalman.estimate
    assert estimate is not None
    assert estimate.radius_m == pytest.approx(1.5 * BALL.radius_m)
    low_m, high_m = estimate.radius_interval_m(1.96)
    assert low_m is not None and 0.0 < low_m < BALL.radius_m
    assert high_m is None  # χ may be zero for all that is known
    assert estimate.radius_std_m is None


def test_the_interval_of_a_known_radius_is_that_of_its_inverse() -> None:
    kalman = filter_of(BALL)
    for t_s in REGULAR:
        kalman.correct(at(BALL, t_s), t_s, EXACT)
    estimate = kalman.estimate
    assert estimate is not None and estimate.variance is not None
    assert estimate.radius_std_m == pytest.approx(
        np.sqrt(estimate.variance) / estimate.chi**2, rel=1e-6
    )


@pytest.mark.parametrize(
    ("low", "guess", "high"), [(0.0, 1.0, 2.0), (2.0, 1.0, 3.0), (1.0, 4.0, 3.0)]
)
def test_a_prior_without_its_guess_is_refused(low: float, guess: float, high: float) -> None:
    with pytest.raises(ValueError, match="low <= guess <= high"):
        RadiusPrior(guess, low, high)
