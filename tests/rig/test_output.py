"""Output whose reader is gone: no write fails, and a run is asked to stop."""

import os
import sys

import pytest

from rig.output import patient_output, reader_is_gone
from rig.stop_request import StopRequest


def test_what_is_written_arrives_and_the_streams_of_before_come_back(
    capsys: pytest.CaptureFixture[str],
) -> None:
    before = sys.stdout
    with patient_output():
        print("here")
        print("and here", file=sys.stderr)
        assert not reader_is_gone()
    assert sys.stdout is before
    assert capsys.readouterr() == ("here\n", "and here\n")


@pytest.mark.parametrize("name", ["stdout", "stderr"])
def test_a_reader_that_went_away_stops_the_run_instead_of_raising(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    reading, writing = os.pipe()
    with os.fdopen(writing, "w") as stream:
        monkeypatch.setattr(sys, name, stream)
        with patient_output(), StopRequest() as stop_requested:
            print("kept", file=getattr(sys, name), flush=True)
            os.close(reading)
            assert not stop_requested()
            print("lost", file=getattr(sys, name), flush=True)
            assert stop_requested()
            print("lost as well", file=getattr(sys, name), flush=True)
