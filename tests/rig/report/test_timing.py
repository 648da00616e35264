"""Lateness, latency and drops, found again in a record."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimator.image.intrinsics import Intrinsics
from rig.config_load import load_config
from rig.recorded.record import FrameEntry, RunRecord
from rig.recorded.setup import RunSetup
from rig.replay.recording import Tick
from rig.report.timing import dropped_at_s, image_latency_s, tick_lateness_s
from rig.run_data import RunData

LENS = Intrinsics(800.0, 800.0, 320.0, 240.0)


def record_of(late_s: list[float], frames: tuple[FrameEntry, ...] = ()) -> RunRecord:
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
        ticks=tuple(Tick(0.01 * k, late, 0) for k, late in enumerate(late_s)),
        commands=(),
        events=(),
        pictures=(),
    )


def test_lateness_is_what_each_tick_recorded() -> None:
    late_s = [0.0, 2e-4, 3e-3]
    assert tick_lateness_s(record_of(late_s)).tolist() == late_s


def test_a_run_without_ticks_has_no_lateness() -> None:
    assert len(tick_lateness_s(record_of([]))) == 0


def test_latency_counts_from_the_exposure_that_the_calibration_found() -> None:
    frames = tuple(FrameEntry(0.1 * k, 0.1 * k + 0.05, k, "") for k in range(3))
    handled_s, latency_s = image_latency_s(record_of([], frames))
    assert handled_s == pytest.approx([0.05, 0.15, 0.25])
    assert latency_s == pytest.approx(0.07)


def test_gaps_in_the_sequence_are_drops_at_the_image_after_them() -> None:
    frames = [FrameEntry(0.1 * k, 0.1 * k + 0.05, k, "") for k in range(6)]
    kept = tuple(replace(frames[k], reason="") for k in (0, 1, 4, 5))
    (when_s, count), *others = dropped_at_s(record_of([], kept))
    assert (when_s, count, others) == (pytest.approx(0.45), 2, [])
