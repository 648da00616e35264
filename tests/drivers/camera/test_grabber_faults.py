"""The grab loop on simulated time: failures are noticed, told in words, and survived."""

import numpy as np
import pytest

from drivers.camera.settings import CameraControls
from drivers.interfaces import GreyImage
from tests.drivers.camera.grabber_bench import Bench
from tests.drivers.camera.scripted import PERIOD_S, TIMEOUT_S, noise

DETECTION_S = 2 * PERIOD_S + TIMEOUT_S


@pytest.mark.parametrize("offset_s", [0.0, 0.011, 0.5])
def test_unplugged_is_noticed_at_once_and_mended_when_plugged_in_again(offset_s: float) -> None:
    bench = Bench(rate_check_s=0.2)
    at_s = bench.open() + 1.0 + offset_s
    back_s = at_s + 3.0
    bench.script.gone = lambda t_s: at_s <= t_s < back_s
    bench.run_until(at_s)
    assert bench.noticed_after_s(at_s) <= 2 * PERIOD_S
    bench.run_until(back_s)
    assert bench.grabber.health().state == "reopening"
    before = len(bench.delivered)
    bench.run_until(back_s + bench.settings.max_backoff_s + 1.0)
    health = bench.grabber.health()
    assert (health.state, health.problem, health.reopened) == ("streaming", None, 1)
    resumed = bench.delivered[before:]
    assert len(resumed) > 10
    seqs = [frame.seq for _, frame in bench.delivered]
    assert np.all(np.diff(seqs) > 0)
    gap_s = resumed[0][1].t_exposure_mid_s - bench.delivered[before - 1][1].t_exposure_mid_s
    assert resumed[0][1].seq - seqs[before - 1] == round(gap_s / PERIOD_S)


def test_a_stall_is_noticed_within_two_periods_and_the_timeout() -> None:
    bench = Bench(rate_check_s=0.2)
    at_s = bench.open() + 1.0
    bench.script.stalled = lambda t_s: at_s <= t_s < at_s + 4.0
    bench.run_until(at_s)
    assert bench.noticed_after_s(at_s) <= DETECTION_S
    assert "stalled" in str(bench.grabber.health().problem)
    bench.run_until(at_s + 12.0)
    assert bench.grabber.health().state == "streaming"
    assert bench.delivered[-1][0] > at_s + 11.0


def test_while_a_grab_still_blocks_the_camera_shows_as_stalled() -> None:
    bench = Bench()
    bench.open()
    assert bench.grabber.health().state == "streaming"
    bench.clock.sleep_until(bench.clock.now_s() + 0.2)
    health = bench.grabber.health()
    assert health.state == "stalled"
    assert "no frame for 0.2" in str(health.problem)


def test_a_single_damaged_buffer_is_left_out_and_counted() -> None:
    bench = Bench()
    start_s = bench.open()
    bad = round(start_s / PERIOD_S) + 10
    bench.script.corrupt = lambda n: n == bad
    bench.run_until(start_s + 1.0)
    health = bench.grabber.health()
    assert (health.corrupt, health.reopened, health.problem) == (1, 0, None)
    assert 2 in np.diff([frame.seq for _, frame in bench.delivered])


def test_only_damaged_buffers_are_a_lost_camera() -> None:
    bench = Bench(rate_check_s=0.2)
    at_s = bench.open() + 0.5
    bench.script.corrupt = lambda n: at_s <= n * PERIOD_S < at_s + 1.0
    bench.run_until(at_s)
    assert bench.noticed_after_s(at_s) <= 2 * PERIOD_S
    assert "damaged" in str(bench.grabber.health().problem)
    bench.run_until(at_s + 3.0)
    health = bench.grabber.health()
    assert health.reopened >= 1
    assert (health.state, health.problem) == ("streaming", None)


def test_a_repeated_picture_is_never_delivered_as_new() -> None:
    bench = Bench(rate_check_s=0.2, max_identical=None)
    at_s = bench.open() + 0.5
    bench.script.stamp = lambda t_s: min(t_s, at_s)
    bench.run_until(at_s + 3.0)
    assert max(frame.t_exposure_mid_s for _, frame in bench.delivered) <= at_s
    assert bench.grabber.health().refused > 0
    assert bench.grabber.health().reopened >= 1


def test_a_frozen_picture_is_a_lost_camera_until_it_changes(bench_frozen: Bench) -> None:
    bench = bench_frozen
    at_s = bench.open() + 0.5
    back_s = at_s + 3.0

    def image(n: int) -> GreyImage:
        t_s = n * PERIOD_S
        return noise(round(at_s / PERIOD_S) if at_s <= t_s < back_s else n)

    bench.script.image = image
    bench.run_until(at_s + 8 * PERIOD_S)
    assert "frozen" in str(bench.grabber.health().problem)
    delivered = len(bench.delivered)
    bench.run_until(back_s - 0.1)
    # Opened again while still frozen, it delivers nothing.
    assert len(bench.delivered) == delivered
    bench.run_until(back_s + 2.0)
    assert bench.grabber.health().problem is None


@pytest.fixture(params=["kernel", "host"])
def bench_frozen(request: pytest.FixtureRequest) -> Bench:
    bench = Bench(rate_check_s=0.2, max_identical=5, max_backoff_s=0.5)
    if request.param == "host":
        bench.script.stamp = lambda t_s: None
    return bench


def test_a_dark_picture_is_not_taken_for_a_frozen_one() -> None:
    bench = Bench(rate_check_s=0.2, max_identical=5)
    bench.script.image = lambda n: np.zeros((12, 16), np.uint8)
    start_s = bench.open()
    bench.run_until(start_s + 2.0)
    assert bench.grabber.health().reopened == 0


def test_each_opening_sets_every_control_again() -> None:
    bench = Bench(rate_check_s=0.0, controls=CameraControls(exposure_ms=4.0, gain=10))
    bench.script.controls = {"auto_exposure": 3, "exposure": 100, "gain": 0}
    at_s = bench.open() + 0.5
    bench.script.gone = lambda t_s: at_s <= t_s < at_s + 0.1
    bench.run_until(at_s + 2.0)
    assert bench.script.opened == 2
    half = len(bench.script.written) // 2
    assert bench.script.written[:half] == bench.script.written[half:]
    assert half == 3


def test_attempts_are_spaced_out_up_to_the_longest_wait() -> None:
    bench = Bench(first_backoff_s=0.2, max_backoff_s=1.0, give_up_after_s=None)
    at_s = bench.open() + 0.5
    bench.script.gone = lambda t_s: t_s >= at_s
    bench.run_until(at_s + 6.0)
    waits_s = np.diff(bench.script.attempts[1:])
    assert waits_s[:2] == pytest.approx([0.4, 0.8], abs=0.01)
    assert waits_s[2:] == pytest.approx(np.full(len(waits_s) - 2, 1.0), abs=0.01)
    assert len(waits_s) >= 4


def test_it_is_given_up_for_good_after_the_time_configured() -> None:
    bench = Bench(give_up_after_s=3.0, max_backoff_s=0.5)
    at_s = bench.open() + 0.5
    bench.script.gone = lambda t_s: t_s >= at_s
    bench.run_until(at_s + 60.0)
    assert bench.clock.now_s() - at_s == pytest.approx(3.0, abs=0.7)
    health = bench.grabber.health()
    assert health.state == "failed"
    assert "given up after 3" in str(health.problem)
    assert "there is no such camera" in str(bench.grabber.failed)
    bench.grabber.step()
    assert bench.script.released == bench.script.opened == 1


def test_after_reopening_a_wrong_rate_is_a_failure_again() -> None:
    bench = Bench(rate_check_s=0.5, max_backoff_s=0.5, give_up_after_s=5.0)
    at_s = bench.open() + 0.5
    bench.script.gone = lambda t_s: at_s <= t_s < at_s + 0.1
    bench.run_until(at_s + 0.05)
    bench.script.period_s = 1 / 20.0
    bench.run_until(at_s + 60.0)
    assert "30 fps requested, 20.00 measured" in str(bench.grabber.failed)
