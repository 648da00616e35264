"""Signals during a run: asked once it ramps down, insisted on it leaves at once."""

import signal

import pytest

from rig.stop_request import StopRequest
from sim_backend.clock import SimulatedClock


def test_the_first_signal_is_a_request_and_a_late_third_one_insists(
    capsys: pytest.CaptureFixture[str],
) -> None:
    clock = SimulatedClock()
    with StopRequest(clock=clock) as stop_requested:
        assert not stop_requested()
        for _ in range(4):  # in a hurry: the first one has not had time to work
            signal.raise_signal(signal.SIGINT)
        assert stop_requested()
        assert capsys.readouterr().err.count("stopping the arm") == 1
        clock.sleep_until(2.5)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_before_anybody_asks_the_first_signal_leaves_at_once() -> None:
    with StopRequest() as stop_requested:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        assert stop_requested()


def test_the_clean_up_after_the_first_signal_is_left_alone_for_a_while() -> None:
    """A terminal that is closed says so twice."""
    clock = SimulatedClock()
    with StopRequest(clock=clock):
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGHUP)
        signal.raise_signal(signal.SIGHUP)
        clock.sleep_until(2.5)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)


def test_the_handlers_of_before_are_back_afterwards() -> None:
    before = signal.getsignal(signal.SIGINT)
    with StopRequest():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before
