"""Each frame is returned once, and never when it is too old or taken too early."""

import threading

import numpy as np
import pytest

from drivers.camera.newest import NewestFrame
from drivers.interfaces import Frame
from sim_backend.clock import SimulatedClock

IMAGE = np.zeros((2, 2), np.uint8)
EXPOSURE_S = 0.010


def frame(t_s: float, seq: int = 0, source: str = "kernel") -> Frame:
    return Frame(IMAGE, t_s, EXPOSURE_S, seq, source)


def test_only_the_newest_is_returned_and_only_once() -> None:
    newest = NewestFrame(SimulatedClock(1.0), 0.5)
    newest.put(frame(0.90, 1))
    newest.put(frame(0.95, 2))
    taken = newest.take()
    assert taken is not None and taken.seq == 2
    assert newest.take() is None


def test_a_frame_beyond_the_age_limit_is_never_returned() -> None:
    clock = SimulatedClock(1.0)
    newest = NewestFrame(clock, 0.5)
    newest.put(frame(1.0))
    clock.sleep_until(1.51)
    assert newest.take() is None


@pytest.mark.parametrize(
    ("source", "t_s", "late_enough"),
    [
        ("kernel", 2.0 + EXPOSURE_S / 2 - 0.001, False),  # exposure had begun before
        ("kernel", 2.0 + EXPOSURE_S / 2 + 0.004, True),
        ("host", 2.0 + EXPOSURE_S / 2 + 0.004, False),  # its stamp is good to a period only
        ("host", 2.0 + EXPOSURE_S / 2 + 0.040, True),
    ],
)
def test_taken_after_means_that_the_exposure_began_after(
    source: str, t_s: float, late_enough: bool
) -> None:
    newest = NewestFrame(SimulatedClock(2.1), 0.5)
    newest.put(frame(t_s, source=source))
    assert (newest.take(after_s=2.0, period_s=1 / 30) is not None) == late_enough


def test_a_frame_too_early_for_one_reader_is_left_for_another() -> None:
    newest = NewestFrame(SimulatedClock(2.1), 0.5)
    newest.put(frame(1.9))
    assert newest.take(after_s=2.0) is None
    assert newest.take() is not None


def test_waiting_ends_with_the_next_frame_and_with_the_camera() -> None:
    newest = NewestFrame(SimulatedClock(), 0.5)
    for wake in (lambda: newest.put(frame(0.0)), newest.end):
        threading.Timer(0.02, wake).start()
        waiter = threading.Thread(target=newest.wait, args=(newest.puts, 30.0))
        waiter.start()
        waiter.join(10.0)
        assert not waiter.is_alive()


def test_nobody_waits_for_a_frame_that_has_come_meanwhile() -> None:
    newest = NewestFrame(SimulatedClock(), 0.5)
    seen = newest.puts
    newest.put(frame(0.0))
    waiter = threading.Thread(target=newest.wait, args=(seen, 30.0))
    waiter.start()
    waiter.join(10.0)
    assert not waiter.is_alive()
