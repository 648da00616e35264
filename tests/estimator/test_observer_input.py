"""Images late, out of order, missing, noisy, or with the camera at rest: what the observer does."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimator.estimate import Correction
from estimator.image.feature import Feature
from estimator.models.sphere import Sphere
from estimator.observer import Observer
from estimator.twist_history import MotionUnknownError, TwistHistory
from tests.estimator.exact_motion import BALL, Target
from tests.estimator.responses import (
    DURATION_S,
    EXACT,
    MOTION,
    REGULAR,
    TARGETS,
    irregular,
    model_of,
    response,
)


@pytest.mark.parametrize("target", TARGETS)
def test_late_jittered_and_dropped_images_cost_nothing_in_the_final_radius(target: Target) -> None:
    rng = np.random.default_rng(11)
    noise = np.repeat([2e-4, 5e-4], 3) * rng.standard_normal((4000, 6))
    measured = MOTION.history(noise=noise)
    observer = Observer(model_of(target), 20000.0, 1.0, 1.5 * target.radius_m)
    stamps = irregular(3)
    arrivals = stamps + 0.08 + 0.03 * rng.uniform(-1.0, 1.0, stamps.size)
    growing = TwistHistory(span_s=1.0)
    whole = measured.window(0.0, DURATION_S)
    fed = 0
    outcomes = []
    for index in np.argsort(arrivals):
        upto = int(np.searchsorted(whole.times_s, min(arrivals[index], DURATION_S), side="right"))
        growing.extend(whole.times_s[fed:upto], whole.twists_camera[fed:upto])
        fed = upto
        feature = MOTION.feature(target, stamps[index])
        outcomes.append(observer.correct(feature, stamps[index], growing))
    assert outcomes.count(Correction.STALE) >= 1  # jitter reordered some
    assert outcomes.count(Correction.RESTARTED) == 0
    radius_m = observer.predict(DURATION_S, growing).radius_m
    assert radius_m is not None
    assert abs(radius_m / target.radius_m - 1.0) < 2e-3


def test_the_first_image_sets_s_and_the_guess() -> None:
    observer = Observer(Sphere(), 2000.0, 1.0, 0.03)
    before = observer.estimate
    assert before is None
    feature = MOTION.feature(BALL, 1.0)
    assert observer.correct(feature, 1.0, TwistHistory()) is Correction.INITIALISED
    estimate = observer.estimate
    assert estimate is not None
    np.testing.assert_array_equal(estimate.s, feature.s)
    assert estimate.chi == pytest.approx(1.0 / 0.03)
    assert estimate.radius_m == pytest.approx(0.03)
    assert estimate.t_s == 1.0


@pytest.mark.parametrize("stamp_s", [1.0, 0.9])
def test_an_image_not_later_than_the_last_is_ignored(stamp_s: float) -> None:
    observer = Observer(Sphere(), 2000.0, 1.0, 0.03)
    for t_s in (0.9, 1.0):
        observer.correct(MOTION.feature(BALL, t_s), t_s, EXACT)
    before = observer.estimate
    wrong = Feature(np.array([5.0, 5.0, 5.0]), np.eye(3))
    assert observer.correct(wrong, stamp_s, EXACT) is Correction.STALE
    after = observer.estimate
    assert before is not None and after is not None
    assert (after.t_s, after.chi) == (before.t_s, before.chi)
    np.testing.assert_array_equal(after.s, before.s)


def test_an_image_the_arm_has_not_caught_up_with_can_be_offered_again() -> None:
    short = TwistHistory(max_extrapolation_s=0.02)
    whole = EXACT.window(0.0, DURATION_S)
    short.extend(whole.times_s[:501], whole.twists_camera[:501])
    observer = Observer(Sphere(), 2000.0, 1.0, 0.03)
    observer.correct(MOTION.feature(BALL, 0.9), 0.9, short)
    feature = MOTION.feature(BALL, 1.1)
    with pytest.raises(MotionUnknownError):
        observer.correct(feature, 1.1, short)
    short.extend(whole.times_s[501:601], whole.twists_camera[501:601])
    assert observer.correct(feature, 1.1, short) is Correction.APPLIED


def test_after_a_loss_longer_than_the_history_the_radius_is_kept() -> None:
    observer = Observer(Sphere(), 20000.0, 1.0, 0.03)
    response(observer, BALL, REGULAR[:60], EXACT)
    before = observer.estimate
    forgetful = TwistHistory(span_s=0.5)
    whole = EXACT.window(0.0, DURATION_S)
    forgetful.extend(whole.times_s, whole.twists_camera)
    feature = MOTION.feature(BALL, 3.9)
    assert observer.correct(feature, 3.9, forgetful) is Correction.RESTARTED
    after = observer.estimate
    assert before is not None and after is not None
    assert after.chi == before.chi
    np.testing.assert_array_equal(after.s, feature.s)


@pytest.mark.parametrize("target", TARGETS)
def test_a_prediction_is_where_the_target_will_be_and_changes_nothing(target: Target) -> None:
    observer = Observer(model_of(target), 2000.0, 1.0, target.radius_m)
    response(observer, target, REGULAR[:40], EXACT)
    before = observer.estimate
    now_s = REGULAR[39] + 0.08
    ahead = observer.predict(now_s, EXACT)
    truth = MOTION.feature(target, now_s)
    np.testing.assert_allclose(ahead.s, truth.s, atol=1e-4)
    if truth.axis is not None:
        assert ahead.axis is not None
        np.testing.assert_allclose(ahead.axis, truth.axis, atol=1e-6)
    assert ahead.t_s == now_s
    assert ahead.extrapolated_s == 0.0
    after = observer.estimate
    assert before is not None and after is not None
    assert (after.t_s, after.chi) == (before.t_s, before.chi)


def test_a_prediction_beyond_the_measured_motion_says_so() -> None:
    observer = Observer(Sphere(), 2000.0, 1.0, 0.03)
    with pytest.raises(ValueError, match="no image"):
        observer.predict(0.0, EXACT)
    observer.correct(MOTION.feature(BALL, DURATION_S), DURATION_S, EXACT)
    assert observer.predict(DURATION_S, EXACT).extrapolated_s == 0.0
    assert observer.predict(DURATION_S + 0.01, EXACT).extrapolated_s == pytest.approx(0.01)
    with pytest.raises(MotionUnknownError):
        observer.predict(DURATION_S + 0.1, EXACT)
    with pytest.raises(ValueError, match="no image"):
        observer.predict(DURATION_S - 0.1, EXACT)


def test_a_camera_that_stops_leaves_the_radius_alone() -> None:
    """(5) would coast on: z̈ = 0 once σ = 0."""
    history = TwistHistory(span_s=10.0)
    stamps = np.arange(0.0, 4.0, 0.002)
    speed = np.clip((0.5 - stamps) / 0.05, 0.0, 1.0)  # moves, then stands from 0.5 s on
    rng = np.random.default_rng(5)
    twists = np.zeros((stamps.size, 6))
    twists[:, 0] = 0.05 * speed
    noise = np.repeat([2e-4, 5e-4], 3) * rng.standard_normal((stamps.size, 6))
    history.extend(stamps, twists + noise)
    moved = np.concatenate(([0.0], np.cumsum(0.5 * (twists[1:, 0] + twists[:-1, 0]) * 0.002)))
    observer = Observer(Sphere(), 2000.0, 1.0, 0.03)
    chi = []
    for t_s in np.arange(0.0, 3.9, 1.0 / 30.0):
        x = float(np.interp(t_s, stamps, moved))
        s = (BALL.point_m - np.array([x, 0.0, 0.0])) / BALL.radius_m
        s = s + np.array([2e-3, 2e-3, 1e-2]) * rng.standard_normal(3)
        observer.correct(Feature(s, np.eye(3)), t_s, history)
        assert observer.estimate is not None
        chi.append(observer.estimate.chi)
    at_rest = np.array(chi[16:])
    assert abs(chi[16] - chi[0]) > 3.0  # it had moved far
    assert np.abs(at_rest - at_rest[0]).max() < 0.3


def test_a_camera_that_only_stands_or_turns_learns_nothing_and_invents_nothing() -> None:
    history = TwistHistory()
    stamps = np.arange(0.0, 3.0, 0.002)
    history.extend(stamps, np.tile([0.0, 0.0, 0.0, 0.1, 0.2, 0.0], (stamps.size, 1)))
    rng = np.random.default_rng(5)
    observer = Observer(Sphere(), 200000.0, 1.0, 0.03)
    for t_s in np.arange(0.0, 2.9, 1.0 / 30.0):
        s = BALL.point_m / BALL.radius_m + 0.01 * rng.standard_normal(3)
        observer.correct(Feature(s, np.eye(3)), t_s, history)
    assert observer.estimate is not None
    assert observer.estimate.chi == pytest.approx(1.0 / 0.03, rel=1e-12)


@given(
    gaps=st.lists(st.floats(1e-5, 0.3), min_size=3, max_size=15),
    alpha=st.floats(100.0, 3e5),
    damping=st.floats(0.3, 3.0),
    seed=st.integers(0, 1000),
)
@settings(max_examples=25, deadline=None, derandomize=True)
def test_noisy_images_at_any_spacing_keep_the_state_finite_and_bounded(
    gaps: list[float], alpha: float, damping: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    observer = Observer(Sphere(), alpha, damping, 1.5 * BALL.radius_m)
    for t_s in np.cumsum(gaps)[np.cumsum(gaps) < DURATION_S]:
        seen = MOTION.feature(BALL, t_s)
        s = seen.s + 1e-4 * rng.standard_normal(3)
        observer.correct(Feature(s, seen.covariance), t_s, EXACT)
        assert observer.estimate is not None
        assert abs(1.0 / BALL.radius_m - observer.estimate.chi) < 2.0 / BALL.radius_m


def test_while_chi_is_not_positive_there_is_no_radius() -> None:
    observer = Observer(Sphere(), 20000.0, 0.05, 0.2 * BALL.radius_m)  # overshoots below zero
    signs = set()
    for t_s in REGULAR:
        observer.correct(MOTION.feature(BALL, t_s), t_s, EXACT)
        estimate = observer.estimate
        assert estimate is not None
        signs.add(estimate.chi > 0.0)
        assert (estimate.radius_m is None) == (estimate.chi <= 0.0)
    assert signs == {True, False}


@pytest.mark.parametrize(
    "settings_",
    [(0.0, 1.0, 0.02), (2000.0, 0.0, 0.02), (2000.0, 1.0, 0.0), (2000.0, 1.0, -0.02)],
)
def test_gains_and_guess_must_be_positive(settings_: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="must be a positive number"):
        Observer(Sphere(), *settings_)
