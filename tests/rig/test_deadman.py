"""The deadman: fires once when a loop hangs, never while it is fed."""

import threading

from rig.deadman import Deadman


class HandClock:
    """A clock that stands still until it is set."""

    def __init__(self) -> None:
        self.t_s = 0.0

    def now_s(self) -> float:
        return self.t_s

    def sleep_until(self, t_s: float) -> None:
        self.t_s = t_s


def test_it_stops_the_arm_when_the_loop_hangs() -> None:
    clock, stopped = HandClock(), threading.Event()
    deadman = Deadman(clock, 0.01, stopped.set)
    deadman.feed()
    clock.t_s = 0.02
    assert stopped.wait(5.0)
    deadman.close()
    assert deadman.fired == 1


def test_it_stays_quiet_before_the_first_command_and_while_fed() -> None:
    clock, stops = HandClock(), []
    looked = threading.Semaphore(0)

    class Watched(HandClock):
        def now_s(self) -> float:
            looked.release()
            return clock.t_s

    deadman = Deadman(Watched(), 0.01, lambda: stops.append(1))
    clock.t_s = 5.0
    deadman.feed()
    for _ in range(20):  # looks of the guard
        assert looked.acquire(timeout=5.0)
    deadman.close()
    assert stops == []
    assert deadman.fired == 0


def test_it_fires_once_for_one_hang() -> None:
    clock, stops = HandClock(), []
    fired = threading.Event()

    def stop() -> None:
        stops.append(1)
        fired.set()

    deadman = Deadman(clock, 0.01, stop)
    deadman.feed()
    clock.t_s = 1.0
    assert fired.wait(5.0)
    clock.t_s = 2.0
    deadman.close()
    assert stops == [1]


def test_an_arm_at_rest_is_not_guarded_until_the_next_command() -> None:
    clock, stops = HandClock(), []
    looked, fired = threading.Semaphore(0), threading.Event()

    class Watched(HandClock):
        def now_s(self) -> float:
            looked.release()
            return clock.t_s

    def stop() -> None:
        stops.append(1)
        fired.set()

    deadman = Deadman(Watched(), 0.01, stop)
    deadman.feed()
    deadman.rest()
    clock.t_s = 1.0
    deadman.feed()
    deadman.rest()
    clock.t_s = 2.0
    while looked.acquire(blocking=False):
        pass
    assert stops == []
    deadman.feed()
    clock.t_s = 3.0
    assert fired.wait(5.0)
    deadman.close()
    assert stops == [1]
