"""A past run at any time of its own."""

from pathlib import Path

import numpy as np
import pytest

from rig.page.recorded import RecordedStates
from rig.recorded.read import read_run
from rig.recorded.record import RunRecord
from tests.rig.command_line import rig
from tests.rig.report.recorded_runs import record


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> RunRecord:
    out = tmp_path_factory.mktemp("recorded") / "run"
    record(out, "--set", "estimator.kind=observer")
    return read_run(out)


def test_the_end_shows_what_the_summary_says(recorded: RunRecord) -> None:
    states, summary = RecordedStates(recorded), recorded.summary
    assert summary is not None
    end = states.at(states.duration_s)
    assert states.duration_s == pytest.approx(summary["sim_s"], abs=0.02)
    assert end.state == "stopped: duration reached"
    assert end.target_state == "tracking"
    assert (end.frames, end.ticks) == (summary["frames"], summary["ticks"])
    assert end.radius_m == summary["radius_m"]
    assert end.speed_m_s < 5e-3


def test_the_beginning_knows_nothing_yet(recorded: RunRecord) -> None:
    start = RecordedStates(recorded).at(0.0)
    assert start.radius_m is None
    assert start.frames == 0
    assert start.target_state == "searching"
    assert start.T_base_tool is not None


def test_time_goes_forward_in_everything_that_counts(recorded: RunRecord) -> None:
    states = RecordedStates(recorded)
    along = [states.at(t_s) for t_s in np.linspace(0.0, states.duration_s, 40)]
    for name in ("frames", "ticks", "overruns"):
        counts = [getattr(state, name) for state in along]
        assert counts == sorted(counts)
    pictures = [states.picture_at(state.elapsed_s) for state in along]
    assert pictures == sorted(pictures) and pictures[-1] == len(recorded.pictures) - 1
    assert max(state.speed_m_s for state in along) > 0.04
    assert any(state.limited_by for state in along)


def test_a_directory_without_a_run_is_refused(tmp_path: Path) -> None:
    result = rig("view", str(tmp_path))
    assert result.exit_code == 2
    assert "holds no run" in result.stderr
