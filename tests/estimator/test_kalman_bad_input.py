"""What tells nothing does not make the filter surer, and what contradicts is reported."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.estimate import Estimate
from estimator.image.feature import Feature
from estimator.kalman import KalmanFilter, RadiusPrior
from tests.estimator.exact_motion import BALL, Target, Trajectory, Twist, lively
from tests.estimator.noisy_images import TWIST, NoisyArm, estimates, guessed, noisy
from tests.estimator.responses import MOTION, REGULAR, TARGETS, model_of

FloatArray = NDArray[np.float64]

NOISE_PX = 0.005
SHORT = REGULAR[REGULAR < 2.0]
ARM = NoisyArm(lively(0.05, 0.3), 3.0)


def still(t_s: float) -> FloatArray:
    return np.zeros(6)


def turning(t_s: float) -> FloatArray:
    return np.array([0.0, 0.0, 0.0, 0.2 * np.sin(2.0 * t_s), 0.25 * np.cos(1.5 * t_s), 0.3])


def last_of(
    target: Target, twist: Twist, kalman: KalmanFilter | None = None
) -> tuple[Estimate, Estimate]:
    """The first and the last estimate of two seconds of ``twist``."""
    motion = Trajectory(twist, 2.1)
    exact = [motion.feature(target, t_s) for t_s in SHORT]
    first, *_, last = estimates(
        kalman or guessed(target), SHORT, exact, NoisyArm(twist, 2.1), NOISE_PX, 3
    )
    return first, last


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("twist", [still, turning])
def test_a_camera_that_does_not_travel_learns_nothing(target: Target, twist: Twist) -> None:
    first, last = last_of(target, twist)
    assert first.variance is not None and last.variance is not None
    assert last.variance >= 0.999 * first.variance
    assert last.chi == pytest.approx(first.chi, rel=1e-6)
    assert last.radius_std_m is None
    assert last.doubt == ""


def images(t_late_s: float = 0.0, target_m_s: float = 0.0, moves_at_s: float = 0.0) -> Estimate:
    """The last estimate when stamps are late, or the ball itself moves from some instant on."""
    kalman, rng = guessed(BALL), np.random.default_rng(5)
    history = ARM.history(rng)
    for t_s in SHORT[2:]:
        exact = MOTION.feature(BALL, t_s - t_late_s)
        away_m = target_m_s * max(t_s - moves_at_s, 0.0) * np.array([0.0, 1.0, 0.3])
        s = exact.s + away_m / BALL.radius_m
        kalman.correct(noisy(Feature(s, exact.covariance), NOISE_PX, rng), t_s, history)
    assert kalman.estimate is not None
    return kalman.estimate


def test_good_images_leave_no_doubt() -> None:
    estimate = images()
    assert estimate.doubt == ""
    assert estimate.radius_m == pytest.approx(BALL.radius_m, rel=3e-3)


@pytest.mark.parametrize("moves_at_s", [0.0, 1.0])
def test_a_target_that_moves_is_reported(moves_at_s: float) -> None:
    estimate = images(target_m_s=0.01, moves_at_s=moves_at_s)
    assert "the target moves" in estimate.doubt


def test_a_target_that_begins_to_move_does_not_spoil_what_was_found() -> None:
    assert images(target_m_s=0.01, moves_at_s=1.0).radius_m == pytest.approx(
        BALL.radius_m, rel=1e-2
    )


@pytest.mark.parametrize("late_s", [0.05, -0.05])
def test_a_latency_that_is_wrong_by_50_ms_is_reported(late_s: float) -> None:
    assert "the latency is wrong" in images(t_late_s=late_s).doubt


def test_an_instant_as_uncertain_as_was_said_leaves_no_doubt() -> None:
    rng, doubts = np.random.default_rng(8), []
    for time_std_s in (0.0, 2e-3):
        prior = RadiusPrior(0.03, 0.01, 0.09)
        kalman, history = KalmanFilter(model_of(BALL), prior, TWIST, time_std_s), ARM.history(rng)
        for t_s in SHORT[2:]:
            feature = noisy(MOTION.feature(BALL, t_s - 2e-3), NOISE_PX, rng)
            kalman.correct(feature, t_s, history)
        assert kalman.estimate is not None
        doubts.append(kalman.estimate.doubt)
    assert doubts[0] and not doubts[1]


@pytest.mark.parametrize("share", [(0.2, 0.3, 0.5), (2.0, 3.0, 6.0)])
def test_a_range_that_excludes_the_radius_is_reported(share: tuple[float, float, float]) -> None:
    low, guess, high = (factor * BALL.radius_m for factor in share)
    kalman = KalmanFilter(model_of(BALL), RadiusPrior(guess, low, high), TWIST)
    _, last = last_of(BALL, lively(0.05, 0.3), kalman)
    assert "outside the range" in last.doubt
    assert last.radius_m == pytest.approx(BALL.radius_m, rel=1e-2)


def test_understated_noise_is_noticed_and_widens_the_interval() -> None:
    rng = np.random.default_rng(6)
    honest, boastful, history = guessed(BALL), guessed(BALL), ARM.history(rng)
    for t_s in SHORT:
        feature = noisy(MOTION.feature(BALL, t_s), 0.05, rng)
        honest.correct(feature, t_s, history)
        boastful.correct(Feature(feature.s, feature.covariance / 4.0), t_s, history)
    assert honest.estimate is not None and boastful.estimate is not None
    stated, claimed = honest.estimate.radius_std_m, boastful.estimate.radius_std_m
    assert stated is not None and claimed is not None
    # Without notice it would be half of it; the arm's noise, stated rightly, is widened as well.
    assert 0.9 * stated <= claimed <= 2.0 * stated
