"""Lateness, latency and drops, found again in a record."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimator.image.intrinsics import Intrinsics
from rig.config_load import load_config
from rig.recorded import Command, FrameEntry, RunRecord, RunSetup
from rig.report.timing import dropped_at_s, image_latency_s, tick_lateness_s
from rig.run_data import RunData

PERIOD_S = 0.01
LENS = Intrinsics(800.0, 800.0, 320.0, 240.0)


def record_of(ticks_s: np.ndarray, frames: tuple[FrameEntry, ...] = ()) -> RunRecord:
    rest = np.zeros(6)
    return RunRecord(
        directory=Path("run"),
        setup=RunSetup(
            "sphere",
            Intrinsics(800, 800, 320, 240),
            np.eye(4),
            None,
            None,
            "test",
            "20260101-000000",
        ),
        config=load_config("sphere", None, ["calibration.latency_s=0.02"]),
        summary=None,
        data=RunData("sphere", np.eye(4)),
        frames=frames,
        commands=tuple(Command(t_s, rest, rest, rest, ()) for t_s in ticks_s),
        events=(),
        pictures=(),
    )


@pytest.mark.parametrize("seed", range(5))
def test_lateness_is_found_although_the_first_tick_was_late_itself(seed: int) -> None:
    rng = np.random.default_rng(seed)
    late_s = rng.exponential(2e-4, 500).clip(0.0, 0.6 * PERIOD_S)
    late_s[0], late_s[7] = 3e-3, 7e-3
    late_s[100] = 0.0
    ticks_s = 41.3 + PERIOD_S * np.arange(500) + late_s
    assert tick_lateness_s(record_of(ticks_s)) == pytest.approx(late_s, abs=1e-9)


def test_ticks_on_simulated_time_are_not_late() -> None:
    ticks_s = np.array([0.03 + PERIOD_S * k for k in range(600)])
    assert tick_lateness_s(record_of(ticks_s)).max() < 1e-9


def test_a_run_without_ticks_has_no_lateness() -> None:
    assert len(tick_lateness_s(record_of(np.array([])))) == 0


def test_latency_counts_from_the_exposure_that_the_calibration_found() -> None:
    frames = tuple(FrameEntry(0.1 * k, 0.1 * k + 0.05, k, "") for k in range(3))
    handled_s, latency_s = image_latency_s(record_of(np.array([]), frames))
    assert handled_s == pytest.approx([0.05, 0.15, 0.25])
    assert latency_s == pytest.approx(0.07)


def test_gaps_in_the_sequence_are_drops_at_the_image_after_them() -> None:
    frames = [FrameEntry(0.1 * k, 0.1 * k + 0.05, k, "") for k in range(6)]
    kept = tuple(replace(frames[k], reason="") for k in (0, 1, 4, 5))
    (when_s, count), *others = dropped_at_s(record_of(np.array([]), kept))
    assert (when_s, count, others) == (pytest.approx(0.45), 2, [])
