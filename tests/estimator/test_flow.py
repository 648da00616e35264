"""A model integrated along a measured motion arrives where the camera really sees the target."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimator.flow import MAX_STEP_S, integrate, refine
from estimator.ideal import rms_vs_ideal
from estimator.models.sphere import Sphere
from estimator.observer import Observer
from tests.estimator.exact_motion import BALL, Trajectory, lively
from tests.estimator.responses import EXACT, MOTION, REGULAR, ideal, model_of, response

FloatArray = NDArray[np.float64]

KNOTS_S = np.arange(0.0, 4.001, 0.05)
KNOTS = np.array([lively(0.05, 0.3)(t) for t in KNOTS_S])


def cornered(t_s: float) -> FloatArray:
    """A twist that is linear between instants 50 ms apart: an arm that reports at 20 Hz."""
    return np.array([np.interp(t_s, KNOTS_S, column) for column in KNOTS.T])


@given(gaps=st.lists(st.floats(1e-4, 0.1), min_size=1, max_size=12))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_refining_keeps_the_nodes_and_the_line_between_them(gaps: list[float]) -> None:
    times = np.concatenate(([0.0], np.cumsum(gaps)))
    twists = np.random.default_rng(1).standard_normal((times.size, 6))
    fine_s, fine = refine(times, twists)
    assert np.diff(fine_s).max() <= MAX_STEP_S * (1.0 + 1e-9)
    assert np.diff(fine_s).min() > 0.0
    kept = np.abs(fine_s[:, None] - times).min(axis=0)
    assert kept.max() < 1e-12
    for column, fine_column in zip(twists.T, fine.T, strict=True):
        np.testing.assert_allclose(fine_column, np.interp(fine_s, times, column), atol=1e-9)


def test_a_motion_that_is_fine_enough_is_left_as_it_is() -> None:
    times = np.linspace(0.0, 0.008, 5)
    assert refine(times, np.zeros((5, 6)))[0] is times


@pytest.mark.parametrize("duration_s", [0.03, 0.5, 3.5])
def test_a_sphere_ends_where_it_is_seen(duration_s: float) -> None:
    window = EXACT.window(0.2, 0.2 + duration_s)
    s0 = MOTION.feature(BALL, 0.2).s
    chi0 = np.array([1.0 / BALL.radius_m])
    s, chi = integrate(Sphere(), s0[None], chi0[None], window.times_s, window.twists_camera)
    truth = MOTION.feature(BALL, 0.2 + duration_s).s
    np.testing.assert_allclose(s[0, -1], truth, atol=2e-5)
    np.testing.assert_array_equal(chi[0, :, 0], chi0[0])


def test_an_implausibly_fast_twist_is_an_error_not_a_number() -> None:
    times = np.linspace(0.0, 0.25, 64)
    spin = np.tile([0.0, 0.0, 0.0, 400.0, 0.0, 0.0], (64, 1))
    with pytest.raises(ArithmeticError, match="implausibly fast"):
        integrate(Sphere(), np.ones((1, 3)), np.ones((1, 1)), times, spin)


def test_an_arm_that_reports_rarely_is_followed_along_its_straight_lines() -> None:
    motion = Trajectory(cornered, 4.0)
    observer = Observer(model_of(BALL), 20000.0, 1.0, 1.5 * BALL.radius_m)
    history = motion.history(rate_hz=20.0)
    z = response(observer, BALL, REGULAR, history, motion)
    expected = ideal(BALL, 20000.0, 1.0, float(z[0]), REGULAR, motion)
    assert rms_vs_ideal(REGULAR, z, expected) < 5e-5
