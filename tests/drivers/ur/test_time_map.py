"""Controller time on the host's clock: the least delayed arrivals decide, drift is followed."""

import numpy as np
import pytest

from drivers.ur.time_map import TimeMap


def arrivals(seconds, drift, rng, least_s=2e-4, jitter_s=2e-3, rate_hz=500.0):
    """Controller stamps, true host instants and arrivals with one-sided random delays."""
    c = 1000.0 + np.arange(int(seconds * rate_hz)) / rate_hz
    true = 50.0 + (c - 1000.0) * (1.0 + drift)
    return c, true, true + least_s + rng.exponential(jitter_s, len(c))


@pytest.mark.parametrize("drift", [0.0, 50e-6, -120e-6])
def test_stamps_are_true_to_a_tenth_of_the_jitter(drift):
    c, true, arrival = arrivals(40.0, drift, np.random.default_rng(1))
    time_map = TimeMap()
    stamps = np.array([time_map.add(*pair) for pair in zip(c, arrival, strict=True)])
    error = stamps - true
    assert np.abs(error[2500:]).max() < 4e-4  # of which 2e-4 is the least delay, unknowable
    assert abs(time_map.drift - drift) < 5e-6


def test_a_stamp_is_never_later_than_the_arrival():
    c, _, arrival = arrivals(5.0, 200e-6, np.random.default_rng(2))
    time_map = TimeMap()
    assert all(time_map.add(a, b) <= b + 1e-12 for a, b in zip(c, arrival, strict=True))


def test_a_burst_after_a_pause_is_stamped_where_it_belongs():
    c, true, arrival = arrivals(3.0, 0.0, np.random.default_rng(3))
    arrival[1000:1050] = arrival[1049]  # the network held 0.1 s back
    time_map = TimeMap()
    stamps = np.array([time_map.add(*pair) for pair in zip(c, arrival, strict=True)])
    assert np.abs(stamps - true)[1000:1050].max() < 4e-4


def test_a_restarted_controller_starts_the_map_anew():
    time_map = TimeMap()
    for k in range(1000):
        time_map.add(5000.0 + 0.002 * k, 10.0 + 0.002 * k)
    assert time_map.add(3.0, 20.0) == pytest.approx(20.0)
    assert time_map.add(3.002, 20.005) == pytest.approx(20.002)
