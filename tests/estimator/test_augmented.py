"""The filter that also finds when images were exposed and how fast the arm truly is."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.augmented import AugmentedKalmanFilter, ExtraPrior
from estimator.estimate import Correction
from estimator.image.feature import Feature
from estimator.kalman import KalmanFilter, RadiusPrior
from estimator.twist_history import TwistHistory
from tests.estimator.exact_motion import BALL, PIPE, Target, Trajectory, Twist, lively
from tests.estimator.noisy_images import TWIST, NoisyArm, noisy
from tests.estimator.responses import model_of

FloatArray = NDArray[np.float64]

DURATION_S = 2.2
STAMPS = np.arange(0.1, DURATION_S - 0.1, 1.0 / 30.0)
NOISE_PX = 0.01
OFFSET, SCALE = ExtraPrior(time_offset_s=0.03), ExtraPrior(speed_scale=0.05)
BOTH = ExtraPrior(0.03, 0.05)


class Scene:
    """A motion, seen by a camera whose stamps are late and measured by an arm that is off."""

    def __init__(self, twist: Twist) -> None:
        self._truth = Trajectory(twist, DURATION_S)
        self._arm = NoisyArm(twist, DURATION_S)

    def history(self, scale: float, rng: np.random.Generator) -> TwistHistory:
        exact = self._arm.history(rng)
        window = exact.window(exact.start_s, exact.end_s)
        history = TwistHistory(span_s=DURATION_S + 1.0)
        history.extend(window.times_s, window.twists_camera / scale)
        return history

    def feature(self, target: Target, stamp_s: float, offset_s: float) -> Feature:
        return self._truth.feature(target, stamp_s - offset_s)


LIVELY = Scene(lively(0.05, 0.3))
STEADY = Scene(lambda t_s: np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0]))


def prior_of(target: Target) -> RadiusPrior:
    guess_m = 1.5 * target.radius_m
    return RadiusPrior(guess_m, guess_m / 3.0, guess_m * 3.0)


def run(
    scene: Scene,
    target: Target,
    extra: ExtraPrior,
    offset_s: float = 0.0,
    scale: float = 1.0,
    seed: int = 0,
    outlier: int = -1,
) -> AugmentedKalmanFilter:
    rng = np.random.default_rng(seed)
    history = scene.history(scale, rng)
    kalman = AugmentedKalmanFilter(model_of(target), prior_of(target), TWIST, extra)
    for k, stamp_s in enumerate(STAMPS):
        feature = noisy(scene.feature(target, stamp_s, offset_s), NOISE_PX, rng)
        if k == outlier:
            feature = Feature(1.05 * feature.s, feature.covariance, feature.axis)
        done = kalman.correct(feature, stamp_s, history)
        assert (done is Correction.REJECTED) == (k == outlier)
    return kalman


def radius_error(kalman: AugmentedKalmanFilter, target: Target) -> float:
    """In standard deviations."""
    estimate = kalman.estimate
    assert estimate is not None and estimate.variance is not None and estimate.doubt == ""
    return float((estimate.chi - 1.0 / target.radius_m) / np.sqrt(estimate.variance))


@pytest.mark.parametrize("offset_s", [0.02, -0.02])
def test_late_stamps_are_found(offset_s: float) -> None:
    kalman = run(LIVELY, BALL, OFFSET, offset_s=offset_s)
    (found,) = kalman.extra_states
    assert (found.name, found.observable) == ("time_offset", True)
    assert found.std < 5e-4
    assert abs(found.value - offset_s) < 3.0 * found.std
    assert abs(radius_error(kalman, BALL)) < 3.0


@pytest.mark.parametrize("target", [BALL, PIPE], ids=["sphere", "cylinder"])
def test_an_arm_that_is_slower_than_it_says_is_found(target: Target) -> None:
    kalman = run(LIVELY, target, SCALE, scale=0.97)
    (found,) = kalman.extra_states
    assert (found.name, found.observable) == ("speed_scale", True)
    assert found.std < 3e-3
    assert abs(found.value - 0.97) < 3.0 * found.std
    assert abs(radius_error(kalman, target)) < 3.0


def test_both_at_once_despite_an_outlier() -> None:
    kalman = run(LIVELY, BALL, BOTH, offset_s=0.02, scale=0.97, outlier=30)
    offset, scale = kalman.extra_states
    assert abs(offset.value - 0.02) < 3.0 * offset.std < 1.5e-3
    assert abs(scale.value - 0.97) < 3.0 * scale.std < 9e-3
    assert abs(radius_error(kalman, BALL)) < 3.0


def test_a_steady_motion_shows_neither_and_the_radius_stays_as_uncertain() -> None:
    kalman = run(STEADY, BALL, BOTH, offset_s=0.02, scale=0.97)
    assert [found.observable for found in kalman.extra_states] == [False, False]
    assert abs(radius_error(kalman, BALL)) < 3.0
    estimate = kalman.estimate
    assert estimate is not None and estimate.radius_std_m is not None
    # R goes with the speed, of which no more is known than before.
    assert estimate.radius_std_m / BALL.radius_m == pytest.approx(0.05, rel=0.2)


def test_what_is_not_sought_changes_nothing() -> None:
    rng = np.random.default_rng(3)
    history = LIVELY.history(1.0, rng)
    prior = prior_of(BALL)
    plain = KalmanFilter(model_of(BALL), prior, TWIST, 5e-4)
    augmented = AugmentedKalmanFilter(model_of(BALL), prior, TWIST, ExtraPrior(), 5e-4)
    for stamp_s in STAMPS:
        feature = noisy(LIVELY.feature(BALL, stamp_s, 0.0), NOISE_PX, rng)
        assert plain.correct(feature, stamp_s, history) is augmented.correct(
            feature, stamp_s, history
        )
    one, other = plain.estimate, augmented.estimate
    assert one is not None and other is not None and augmented.extra_states == ()
    assert other.chi == pytest.approx(one.chi, rel=1e-5)
    assert other.radius_std_m == pytest.approx(one.radius_std_m, rel=1e-2)
    ahead = plain.predict(STAMPS[-1] + 0.05, history), augmented.predict(STAMPS[-1] + 0.05, history)
    np.testing.assert_allclose(ahead[0].s, ahead[1].s, rtol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("scene", [LIVELY, STEADY], ids=["lively", "steady"])
def test_errors_are_as_large_as_stated(scene: Scene) -> None:
    normalised = []
    for seed in range(40):
        kalman = run(scene, BALL, BOTH, offset_s=0.02, scale=0.97, seed=seed)
        offset, scale = kalman.extra_states
        normalised.append(
            (
                radius_error(kalman, BALL) ** 2,
                ((offset.value - 0.02) / offset.std) ** 2,
                ((scale.value - 0.97) / scale.std) ** 2,
            )
        )
    assert np.all(np.mean(normalised, axis=0) < 1.48)  # 97.5 % of such means
