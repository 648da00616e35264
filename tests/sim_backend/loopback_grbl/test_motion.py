"""The planner and the segments: what any motion must satisfy, whatever the queue."""

import numpy as np
import pytest

from tests.sim_backend.loopback_grbl.helpers import EXACT, Bench


def test_a_move_ends_at_its_target_and_at_rest() -> None:
    bench = Bench()
    bench.send("$J=G91G21X12.34Y-5.67F1800\n")
    bench.wait(1.5)
    q, qd = bench.firmware.joints()
    assert q[0, :2] == pytest.approx([0.01234, -0.00567], abs=1e-9)
    assert not qd.any()
    assert bench.status().startswith("<Idle|")


def test_the_profile_is_a_trapezoid_of_the_axis_acceleration() -> None:
    bench = Bench()
    bench.send("$J=G91G21X50F6000\n")  # 100 mm/s, 1000 mm/s²: 0.1 s up, 0.4 s flat, 0.1 s down
    bench.wait(1.0)
    t, _, qd = bench.motion(0.0)
    moving = np.flatnonzero(qd[:, 0])
    assert t[moving[-1]] - t[moving[0]] == pytest.approx(0.6, abs=0.012)
    assert qd[:, 0].max() == pytest.approx(0.1, rel=1e-6)
    # Segments of 10 ms hold their mean speed: changes come in steps of a · 10 ms.
    assert np.abs(np.diff(qd[:, 0])).max() <= 1.0 * 0.010 * 1.05


def test_the_feed_is_the_norm_over_millimetres_and_degrees() -> None:
    bench = Bench()
    bench.send("$J=G91G21X30A40F3000\n")  # norm 50 at 50 per second
    bench.wait(0.6)
    _, qd = bench.firmware.joints()
    assert qd[0, 0] == pytest.approx(0.030)
    assert np.rad2deg(qd[0, 3]) == pytest.approx(40.0)


def test_no_axis_exceeds_its_speed() -> None:
    bench = Bench()
    bench.send("$J=G91G21X400F999999\n")
    bench.wait(1.0)
    assert bench.motion(0.0)[2][:, 0].max() == pytest.approx(0.250, rel=1e-6)


def test_targets_are_whole_steps_and_the_rest_is_not_lost() -> None:
    bench = Bench()
    for _ in range(10):
        bench.send("$J=G91G21X0.004F60\n")  # 0.4 steps each
    bench.wait(1.0)
    assert bench.firmware.position()[0] == pytest.approx(-800.0 + 0.04, abs=1e-9)
    assert bench.firmware.joints()[0][0, 0] == pytest.approx(4e-5, abs=1e-9)


def test_a_straight_queue_is_driven_through_without_slowing() -> None:
    bench = Bench()
    bench.stream(50.0, 0.6)
    bench.wait(0.5)
    _, _, qd = bench.motion(0.35)
    assert qd[:, 0].min() == pytest.approx(0.050, rel=1e-3)


def test_a_queue_that_turns_back_comes_to_rest_between() -> None:
    bench = Bench()
    bench.send("$J=G91G21X10F3000\n$J=G91G21X-10F3000\n")
    bench.wait(1.5)
    _, q, qd = bench.motion(0.0)
    assert q[:, 0].max() == pytest.approx(0.010, abs=1e-6)
    assert q[-1, 0] == pytest.approx(0.0, abs=1e-9)
    turning = np.flatnonzero(np.diff(np.sign(qd[:, 0])) < 0)
    assert turning.size > 0
    assert np.abs(qd[turning, 0]).max() < 0.012


def test_running_dry_is_a_clean_stop_on_the_last_target() -> None:
    bench = Bench()
    bench.stream(50.0, 0.2)
    bench.wait(1.0)
    assert bench.firmware.joints()[0][0, 0] == pytest.approx(0.010, abs=1e-9)
    _, _, qd = bench.motion(0.0)
    assert np.abs(np.diff(qd[:, 0])).max() < 0.0111


def test_motion_runs_on_the_controllers_own_clock() -> None:
    fast = Bench(machine=type(EXACT)(clock_rate=1.005, lost_status=0.0))
    fast.send("$J=G91G21X50F3000\n")
    fast.wait(0.5)
    assert fast.firmware.joints()[1][0, 0] == pytest.approx(0.050 * 1.005, rel=1e-6)
