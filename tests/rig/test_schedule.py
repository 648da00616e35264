"""The control grid keeps absolute time: lateness is counted, never carried on."""

from itertools import islice

from rig.schedule import TickStats, tick_grid
from sim_backend.clock import SimulatedClock


def test_ticks_fall_on_the_grid_of_the_start() -> None:
    clock, stats = SimulatedClock(5.0), TickStats()
    times = list(islice(tick_grid(clock, 0.01, stats), 1000))
    assert all(abs(t - (5.0 + 0.01 * k)) < 1e-9 for k, t in enumerate(times))
    assert (stats.ticks, stats.overruns) == (1000, 0)
    assert stats.late_p99_s() < 1e-9


def test_a_slow_tick_makes_the_next_one_late_but_not_the_ones_after() -> None:
    clock, stats = SimulatedClock(), TickStats()
    times = []
    for k, now_s in enumerate(tick_grid(clock, 0.01, stats)):
        times.append(round(now_s, 6))
        if k == 2:
            clock.sleep_until(now_s + 0.014)  # into the next period, past one grid point
        if k == 5:
            break
    assert times == [0.0, 0.01, 0.02, 0.034, 0.04, 0.05]
    assert stats.overruns == 0


def test_missed_grid_points_are_skipped_and_counted_never_made_up_for() -> None:
    clock, stats = SimulatedClock(), TickStats()
    times = []
    for k, now_s in enumerate(tick_grid(clock, 0.01, stats)):
        times.append(round(now_s, 6))
        if k == 2:
            clock.sleep_until(now_s + 0.057)
        if k == 4:
            break
    # Points 3 to 6 were missed: one tick runs late on point 7's period, then the grid goes on.
    assert times == [0.0, 0.01, 0.02, 0.077, 0.08]
    assert stats.overruns == 4


def test_lateness_is_summed_up_over_all_ticks() -> None:
    stats = TickStats()
    assert (stats.late_median_s(), stats.late_p99_s(), stats.late_max_s()) == (0.0, 0.0, 0.0)
    stats.late_s += [0.001] * 99 + [0.5]
    assert stats.late_median_s() == 0.001
    assert stats.late_max_s() == 0.5
    assert 0.001 < stats.late_p99_s() < 0.5


def test_the_rate_counts_ticks_over_the_span() -> None:
    stats = TickStats(ticks=300)
    assert stats.rate_hz(3.0) == 100.0
    assert stats.rate_hz(0.0) == 0.0
