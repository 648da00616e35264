"""The stop table as measured on the firmware; times to the end of the last segment."""

import numpy as np
import pytest

from tests.sim_backend.loopback_grbl.helpers import EXACT_GRBL, Bench


def stopped(bench: Bench, action: bytes, speed_mm_s: float) -> tuple[float, float]:
    """Seconds and millimetres from writing ``action`` in full motion to rest."""
    bench.wait(0.5)
    assert bench.firmware.joints()[1][0, 0] == pytest.approx(speed_mm_s * 1e-3, rel=1e-3)
    begun_s = bench.now_s
    bench.send(action)
    bench.wait(1.2)
    t, q, qd = bench.motion(begun_s)
    moving = np.flatnonzero(qd[:, 0])
    return float(t[moving[-1]] - begun_s), float(q[-1, 0] - q[0, 0]) * 1e3


def jogging(speed_mm_s: float) -> Bench:
    bench = Bench()
    bench.stream(speed_mm_s, 0.9)
    return bench


def moving_by_g1(speed_mm_s: float) -> Bench:
    bench = Bench()
    bench.send(f"G91G1X{speed_mm_s:.1f}F{speed_mm_s * 60:.0f}\n")
    return bench


@pytest.mark.parametrize(("speed", "time_s", "way_mm"), [(50, 0.064, 2.5), (200, 0.218, 24.9)])
def test_jog_cancel(speed: float, time_s: float, way_mm: float) -> None:
    bench = jogging(speed)
    found_s, found_mm = stopped(bench, b"\x85", speed)
    assert found_s == pytest.approx(time_s, abs=0.018)
    assert found_mm == pytest.approx(way_mm, rel=0.15)
    assert bench.status().startswith("<Idle|")
    assert "Bf:100," in bench.status()


@pytest.mark.parametrize(("speed", "time_s", "way_mm"), [(50, 0.138, 6.0), (200, 0.292, 39.0)])
def test_feed_hold_of_a_programme_and_its_end(speed: float, time_s: float, way_mm: float) -> None:
    bench = moving_by_g1(speed)
    found_s, found_mm = stopped(bench, b"!", speed)
    assert found_s == pytest.approx(time_s, abs=0.018)
    assert found_mm == pytest.approx(way_mm, rel=0.15)
    assert bench.status().startswith("<Hold:0|")
    assert bench.ask("$I") == []  # nothing is parsed in a hold
    bench.send(b"~")
    bench.wait(1.5)
    assert bench.firmware.joints()[0][0, 0] == pytest.approx(speed * 1e-3, abs=1e-9)


@pytest.mark.parametrize(("speed", "way_mm"), [(50, 0.5), (200, 1.3)])
def test_reset_stops_without_deceleration(speed: float, way_mm: float) -> None:
    bench = jogging(speed)
    time_s, way = stopped(bench, b"\x18", speed)
    assert time_s < 0.012
    assert way == pytest.approx(way_mm, abs=0.25)


def test_jog_cancel_does_not_touch_a_programme() -> None:
    bench = moving_by_g1(50.0)
    assert stopped(bench, b"\x85", 50.0)[1] > 20.0


def test_feed_hold_does_not_touch_a_jog_on_grblhal() -> None:
    bench = jogging(50.0)
    assert stopped(bench, b"!", 50.0)[1] > 15.0


def test_feed_hold_cancels_a_jog_on_plain_grbl() -> None:
    bench = Bench(EXACT_GRBL)
    bench.send("$J=G91G21X100F3000\n")
    bench.wait(0.5)
    bench.send(b"!")
    bench.wait(0.3)
    assert bench.status().startswith("<Idle|")
    assert bench.firmware.joints()[0][0, 0] < 0.032


def test_a_cancel_waits_behind_the_bytes_before_it() -> None:
    bench = Bench()
    bench.send("$J=G91G21X100F3000\n")
    bench.wait(0.5)
    begun_s = bench.now_s
    bench.send("$J=G91G21X0.100F3000\n" * 60)  # 1260 bytes are 109 ms at 115200 baud
    bench.send(b"\x85")
    bench.wait(1.0)
    t, _, qd = bench.motion(begun_s)
    assert t[np.flatnonzero(qd[:, 0])[-1]] - begun_s > 0.109 + 0.050


def test_silence_is_no_stop_before_the_queue_is_empty() -> None:
    bench = Bench()
    bench.stream(50.0, 0.8)  # 40 blocks, then never a byte again
    bench.wait(2.0)
    assert bench.firmware.joints()[0][0, 0] == pytest.approx(0.040, abs=1e-9)
