"""Signals during a run: asked once it ramps down, insisted on it leaves at once."""

import signal

import pytest

from rig.stop_request import StopRequest


def test_the_first_signal_is_a_request_and_the_third_insists(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with StopRequest() as stop_requested:
        assert not stop_requested()
        signal.raise_signal(signal.SIGINT)
        assert stop_requested()
        assert "stopping the arm" in capsys.readouterr().err
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_the_handlers_of_before_are_back_afterwards() -> None:
    before = signal.getsignal(signal.SIGINT)
    with StopRequest():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before
