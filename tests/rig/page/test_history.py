"""What the page's plots are given: bounded, in order, and nothing a plot cannot draw."""

import numpy as np
import pytest

from rig.page.history import History
from rig.page.state import PageState


def state(elapsed_s: float, radius_m: float | None = None, late_s: float = 0.0) -> PageState:
    return PageState(
        elapsed_s=elapsed_s,
        state="running",
        target_state="tracking",
        frames=0,
        frames_lost=0,
        ticks=round(100 * elapsed_s),
        overruns=0,
        late_s=late_s,
        speed_m_s=0.0,
        limited_by=(),
        radius_m=radius_m,
        spread_m=None if radius_m is None else 1e-3,
    )


def test_before_the_first_estimate_there_is_something_to_draw_all_the_same() -> None:
    history = History()
    assert [column.tolist() for column in history.radius()] == [[0.0]] * 4
    assert history.rate_hz is None
    history.add(state(0.1))
    assert all(np.all(np.isfinite(column)) for column in history.radius())


def test_the_radius_is_drawn_with_its_spread_from_the_first_estimate_on() -> None:
    history = History()
    for number in range(20):
        history.add(state(0.1 * number, 0.02 if number >= 5 else None))
    t_s, low, high, radius = history.radius()
    assert t_s == pytest.approx(np.arange(5, 20) * 0.1)
    assert (low[0], high[0], radius[0]) == pytest.approx((19.0, 21.0, 20.0))
    assert history.rate_hz == pytest.approx(100.0)


def test_the_greatest_lateness_between_two_rows_is_kept() -> None:
    history = History()
    for number in range(101):
        history.add(state(0.01 * number, 0.02, late_s=5e-3 if number == 57 else 1e-4))
    _, late_ms, _ = history.health()
    assert late_ms.max() == pytest.approx(5.0)
    assert np.sum(late_ms > 1.0) == 1


def test_an_hour_is_kept_as_its_last_minute() -> None:
    history = History()
    for number in range(36_000):
        history.add(state(0.1 * number, 0.02))
    t_s = history.radius()[0]
    assert len(t_s) == 600
    assert t_s[-1] - t_s[0] == pytest.approx(59.9)


def test_a_run_that_is_wound_back_begins_anew() -> None:
    history = History()
    for elapsed_s in (1.0, 1.1, 1.2, 0.3):
        history.add(state(elapsed_s, 0.02))
    assert history.radius()[0].tolist() == [0.3]
