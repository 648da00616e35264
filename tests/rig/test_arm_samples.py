"""Samples of an arm that make no sense end a run as a device failure, with the arm stopped."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.interfaces import ArmState
from rig.outcome import Ending
from tests.rig.fakes import Bench, make_bench

NO_NUMBER = np.full(6, np.nan)


def spoil(bench: Bench, bad: dict[str, object]) -> None:
    """From 1 s on every read gives the newest sample with ``bad`` in it."""
    honest = bench.arm.read_states

    def read_states() -> list[ArmState]:
        states = honest()
        if bench.clock.now_s() < 1.0 or not states:
            return states
        return [*states, replace(states[-1], **bad)]  # type: ignore[arg-type]

    bench.arm.read_states = read_states  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ("bad", "words"), [({}, "stamps must increase"), ({"twist_tool": NO_NUMBER}, "finite")]
)
def test_they_end_the_run_in_words(tmp_path: Path, bad: dict[str, object], words: str) -> None:
    bench = make_bench(tmp_path, ["run.duration_s=6"])
    spoil(bench, bad)
    outcome = bench.run()
    assert outcome.ending is Ending.DEVICE_FAILURE
    assert words in str(outcome.error) and "start again" in str(outcome.error)
    assert bench.arm.stops >= 1
