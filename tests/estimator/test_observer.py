"""The observer from 30 Hz images follows the ideal response (5), whatever the motion."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.ideal import ideal_response, rms_vs_ideal
from estimator.models.sphere import Sphere
from estimator.observer import Observer
from estimator.twist_history import TwistHistory
from tests.estimator.exact_motion import BALL, Target, Trajectory
from tests.estimator.responses import (
    EXACT,
    MOTION,
    REGULAR,
    TARGETS,
    ideal,
    irregular,
    model_of,
    response,
)

FloatArray = NDArray[np.float64]


def deviation(
    target: Target, alpha: float, damping: float, stamps: FloatArray, history: TwistHistory
) -> float:
    observer = Observer(model_of(target), alpha, damping, 1.5 * target.radius_m)
    z = response(observer, target, stamps, history)
    return rms_vs_ideal(stamps, z, ideal(target, alpha, damping, float(z[0]), stamps))


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("damping", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("alpha", [500.0, 2000.0, 20000.0, 200000.0])
def test_from_rest_and_through_every_turn_the_error_is_the_ideal_one(
    target: Target, alpha: float, damping: float
) -> None:
    assert deviation(target, alpha, damping, REGULAR, EXACT) < 5e-5


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("alpha", [500.0, 200000.0])
def test_irregular_and_missing_images_change_nothing(target: Target, alpha: float) -> None:
    stamps = irregular(1)
    assert deviation(target, alpha, 1.0, stamps, EXACT) < 5e-5


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize(("alpha", "bound"), [(2000.0, 1.5e-3), (20000.0, 2.5e-3)])
def test_a_real_arms_twist_noise_hardly_shows(target: Target, alpha: float, bound: float) -> None:
    rng = np.random.default_rng(7)
    noise = np.repeat([2e-4, 5e-4], 3) * rng.standard_normal((4000, 6))
    assert deviation(target, alpha, 1.0, REGULAR, MOTION.history(noise=noise)) < bound


@pytest.mark.parametrize("target", TARGETS)
def test_an_arm_that_reports_at_100_hz_is_enough(target: Target) -> None:
    assert deviation(target, 2000.0, 1.0, REGULAR, MOTION.history(rate_hz=100.0)) < 3e-4


def test_moving_at_the_first_image_the_response_starts_there() -> None:
    stamps = irregular(2)[30:]
    assert deviation(BALL, 20000.0, 1.0, stamps, EXACT) < 5e-5


def shuttle(t_s: float) -> FloatArray:
    """To and fro along x: σ passes through zero at every reversal."""
    return np.array([0.05 * np.sin(4.0 * t_s), 0.0, 0.0, 0.02, 0.0, 0.05 * np.cos(t_s)])


@pytest.mark.parametrize("alpha", [500.0, 2000.0, 20000.0, 200000.0])
def test_a_camera_that_reverses_keeps_the_response(alpha: float) -> None:
    there_and_back = Trajectory(shuttle, 3.0)
    history = there_and_back.history()
    observer = Observer(Sphere(), alpha, 1.0, 1.5 * BALL.radius_m)
    z = []
    stamps = np.arange(0.0, 3.0, 1.0 / 30.0)
    for t_s in stamps:
        observer.correct(there_and_back.feature(BALL, t_s), t_s, history)
        assert observer.estimate is not None
        z.append(1.0 / BALL.radius_m - observer.estimate.chi)
    fine = np.append(np.arange(0.0, stamps[-1], 5e-4), stamps[-1])
    expected = ideal_response(fine, 0.0025 * np.sin(4.0 * fine) ** 2, alpha, 1.0, z[0], stamps)
    assert rms_vs_ideal(stamps, z, expected) < 1e-4
