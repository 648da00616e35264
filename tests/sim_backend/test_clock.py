"""Simulated time."""

import math

import pytest

from sim_backend.clock import SimulatedClock


def test_time_stands_still_until_somebody_sleeps():
    clock = SimulatedClock(5.0)
    assert clock.now_s() == clock.now_s() == 5.0
    clock.sleep_until(6.5)
    assert clock.now_s() == 6.5


def test_sleeping_until_the_past_changes_nothing():
    clock = SimulatedClock(5.0)
    clock.sleep_until(4.0)
    assert clock.now_s() == 5.0


@pytest.mark.parametrize("t_s", [math.nan, math.inf, -math.inf])
def test_an_instant_that_never_comes_is_refused(t_s):
    clock = SimulatedClock()
    with pytest.raises(ValueError, match="cannot sleep"):
        clock.sleep_until(t_s)
    assert clock.now_s() == 0.0
