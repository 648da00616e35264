"""Dropped frames show as gaps; the rate is that of the stamps."""

import numpy as np
import pytest

from drivers.camera.counting import ExposureCounter, RateMeter

PERIOD_S = 1.0 / 30.0


def test_gaps_in_the_sources_own_numbers_are_dropped_frames() -> None:
    counter = ExposureCounter(PERIOD_S)
    sequences = [7, 8, 11, 12]
    seqs = [counter.next(PERIOD_S * s, s, own_stamp=True) for s in sequences]
    assert seqs == [0, 1, 4, 5]
    assert counter.dropped == 2


def test_without_numbers_gaps_in_the_stamps_are_dropped_frames() -> None:
    counter = ExposureCounter(PERIOD_S)
    jitter_s = [0.0, 0.004, -0.005, 0.003]
    times_s = [PERIOD_S * n + j for n, j in zip([0, 1, 3, 4], jitter_s, strict=True)]
    assert [counter.next(t, None, own_stamp=True) for t in times_s] == [0, 1, 3, 4]
    assert counter.dropped == 1


def test_from_late_arrivals_nothing_is_concluded() -> None:
    counter = ExposureCounter(PERIOD_S)
    assert [counter.next(t, None, own_stamp=False) for t in (0.0, 0.1, 0.11)] == [0, 1, 2]
    assert counter.dropped == 0


def test_numbers_go_on_after_an_interruption_though_the_source_starts_anew() -> None:
    counter = ExposureCounter(PERIOD_S)
    counter.next(0.0, 500, own_stamp=True)
    counter.reopened()
    assert counter.next(30 * PERIOD_S, 0, own_stamp=True) == 30
    assert counter.next(31 * PERIOD_S, 1, own_stamp=True) == 31
    assert counter.dropped == 0


def test_a_sequence_that_stands_still_never_repeats_a_number() -> None:
    counter = ExposureCounter(PERIOD_S)
    assert [counter.next(PERIOD_S * n, 3, own_stamp=True) for n in range(3)] == [0, 1, 2]


def test_the_rate_leaves_out_the_first_frames_and_needs_its_whole_span() -> None:
    meter = RateMeter(span_s=1.0, skip=2)
    for t_s in (0.0, 0.7):
        meter.add(t_s)
    assert meter.rate_hz is None
    done = []
    for t_s in np.arange(1.0, 2.001, 0.05):
        meter.add(t_s)
        done.append(meter.done)
    assert done == 20 * [False] + [True]
    assert meter.rate_hz == pytest.approx(20.0)
