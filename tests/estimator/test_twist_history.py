"""The history answers what was measured, says when it extrapolates, and refuses to guess."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from estimator.twist_history import MotionUnknownError, TwistHistory

SLOPE = np.array([1.0, -2.0, 0.5, 0.1, -0.3, 0.0])


def linear(times_s: ArrayLike) -> NDArray[np.float64]:
    twists: NDArray[np.float64] = np.asarray(times_s, dtype=float)[:, None] * SLOPE
    return twists


def test_between_stamps_the_twist_is_linear() -> None:
    history = TwistHistory()
    times = np.array([0.0, 0.013, 0.02, 0.1])
    history.extend(times, linear(times))
    for t in (0.0, 0.005, 0.013, 0.0199, 0.06, 0.1):
        sample = history.at(t)
        np.testing.assert_allclose(sample.twist_camera, t * SLOPE, atol=1e-15)
        assert sample.extrapolated_s == 0.0


@given(
    gaps=st.lists(st.floats(1e-4, 0.1), min_size=1, max_size=40),
    ends=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_a_window_is_its_ends_and_every_stamp_strictly_between(
    gaps: list[float], ends: tuple[float, float]
) -> None:
    stamps = np.concatenate(([0.0], np.cumsum(gaps)))
    history = TwistHistory(span_s=100.0)
    history.extend(stamps, linear(stamps))
    t0, t1 = sorted(share * stamps[-1] for share in ends)
    window = history.window(t0, t1)
    expected = [t0, *stamps[(stamps > t0) & (stamps < t1)]] + ([t1] if t1 > t0 else [])
    np.testing.assert_array_equal(window.times_s, expected)
    np.testing.assert_allclose(window.twists_camera, linear(window.times_s), atol=1e-12)
    assert window.extrapolated_s == 0.0


def test_outside_the_span_the_nearest_sample_is_held_and_labelled() -> None:
    history = TwistHistory(max_extrapolation_s=0.02)
    history.extend([1.0, 1.1], [[1.0] * 6, [2.0] * 6])
    late = history.at(1.115)
    assert late.extrapolated_s == pytest.approx(0.015)
    np.testing.assert_array_equal(late.twist_camera, [2.0] * 6)
    early = history.at(0.99)
    assert early.extrapolated_s == pytest.approx(0.01)
    np.testing.assert_array_equal(early.twist_camera, [1.0] * 6)
    window = history.window(1.05, 1.112)
    assert window.extrapolated_s == pytest.approx(0.012)
    np.testing.assert_array_equal(window.times_s, [1.05, 1.1, 1.112])
    np.testing.assert_array_equal(window.twists_camera[:, 0], [1.5, 2.0, 2.0])


def test_too_far_outside_is_an_error_that_names_the_span() -> None:
    history = TwistHistory(max_extrapolation_s=0.02)
    with pytest.raises(MotionUnknownError, match="no twist"):
        history.at(0.0)
    history.append(1.0, np.zeros(6))
    with pytest.raises(MotionUnknownError, match=r"1\.000000"):
        history.at(1.021)
    with pytest.raises(MotionUnknownError):
        history.window(0.9, 1.0)
    assert not history.covers(0.9)
    assert history.covers(0.99)


def test_a_single_sample_is_held_around_its_instant() -> None:
    history = TwistHistory(max_extrapolation_s=0.02)
    history.append(1.0, np.arange(6.0))
    for t in (0.99, 1.0, 1.01):
        np.testing.assert_array_equal(history.at(t).twist_camera, np.arange(6.0))


@pytest.mark.parametrize("t_s", [1.0, 0.5])
def test_a_stamp_that_does_not_increase_is_refused(t_s: float) -> None:
    history = TwistHistory()
    history.append(1.0, np.zeros(6))
    with pytest.raises(ValueError, match="must increase"):
        history.append(t_s, np.zeros(6))
    with pytest.raises(ValueError, match="must increase"):
        history.extend([1.1, 1.1], np.zeros((2, 6)))
    assert len(history) == 1


def test_what_is_not_a_number_or_not_a_twist_is_refused() -> None:
    history = TwistHistory()
    with pytest.raises(ValueError, match="finite"):
        history.append(0.0, [0.0, 0.0, np.nan, 0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="finite"):
        history.append(np.inf, np.zeros(6))
    with pytest.raises(ValueError, match="expected"):
        history.append(0.0, np.zeros(3))
    with pytest.raises(ValueError, match="backwards"):
        history.window(1.0, 0.0)


@given(batches=st.lists(st.integers(0, 700), min_size=1, max_size=20))
@settings(max_examples=30, deadline=None, derandomize=True)
def test_however_it_is_fed_the_span_is_kept_and_the_rest_forgotten(batches: list[int]) -> None:
    history = TwistHistory(span_s=1.0)
    start = 0
    for size in batches:
        times = np.arange(start, start + size) / 500.0
        history.extend(times, linear(times))
        start += size
    if start == 0:
        assert len(history) == 0
        return
    newest = (start - 1) / 500.0
    assert history.end_s == newest
    assert history.start_s <= max(newest - 1.0, 0.0)  # the whole span is covered
    assert len(history) <= 502  # and no more than one sample beyond
    oldest = history.start_s
    window = history.window(oldest, newest)
    np.testing.assert_allclose(window.twists_camera, linear(window.times_s), atol=1e-12)


def test_answers_are_copies_that_later_samples_do_not_touch() -> None:
    history = TwistHistory(span_s=0.01)
    history.append(0.0, np.ones(6))
    sample = history.at(0.0)
    sample.twist_camera[:] = 7.0
    np.testing.assert_array_equal(history.at(0.0).twist_camera, np.ones(6))


def test_a_long_run_at_500_hz_stays_small() -> None:
    history = TwistHistory(span_s=2.0)
    for index in range(20_000):
        history.append(index / 500.0, np.full(6, float(index)))
    assert len(history) <= 1002
    np.testing.assert_allclose(history.at(39.001).twist_camera, 19_500.5)


def test_a_span_that_is_not_positive_is_refused() -> None:
    with pytest.raises(ValueError, match="span_s"):
        TwistHistory(span_s=0.0)
    with pytest.raises(ValueError, match="max_extrapolation_s"):
        TwistHistory(max_extrapolation_s=-0.1)
