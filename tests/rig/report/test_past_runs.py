"""What is shown of runs that went wrong, were cut off, or never began."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from rig.log.run_log import LOG_NAME
from rig.recorded.read import read_run
from rig.report.headline import JUDGED, STATED, error_bar
from tests.rig.command_line import rig
from tests.rig.log_lines import log_bytes
from tests.rig.report.recorded_runs import record


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One run of the observer, which states no deviation, and its summary."""
    out = tmp_path_factory.mktemp("runs") / "whole"
    record(out, "--set", "estimator.kind=observer")
    return out


def copy_of(run_dir: Path, out: Path, without: tuple[str, ...] = ()) -> Path:
    out.mkdir()
    for path in run_dir.iterdir():
        if path.is_file() and path.name not in without:
            (out / path.name).write_bytes(path.read_bytes())
    return out


def test_a_record_holds_what_the_run_held(recorded: Path) -> None:
    run = read_run(recorded)
    assert run.summary == json.loads((recorded / "summary.json").read_text())
    assert run.data.frames == run.summary["frames"] == len(run.frames)
    assert len(run.data.updates) > 40
    assert run.data.updates[-1].radius_m == run.summary["radius_m"]
    assert run.setup.radius_true_m == run.summary["radius_true_m"]
    assert run.events[0].name == "started"
    assert run.start_s == run.data.updates[0].t_s
    assert len(run.pictures) == len(run.frames)
    newest = next(p for p in run.pictures if p.t_s == run.data.updates[-1].t_s)
    assert newest.load().shape == (480, 640)
    assert newest.feature is not None and newest.feature.s.shape == (3,)
    assert not np.array_equal(newest.load(), run.pictures[0].load())


def test_an_image_is_the_same_with_and_without_an_index(recorded: Path, tmp_path: Path) -> None:
    run_dir = copy_of(recorded, tmp_path / "killed")
    log = log_bytes(recorded)
    (run_dir / LOG_NAME).write_bytes(log[: len(log) // 2])
    found, searched = read_run(recorded), read_run(run_dir)
    assert 0 < len(searched.pictures) < len(found.pictures)
    for number in (0, len(searched.pictures) - 1):
        assert np.array_equal(found.pictures[number].load(), searched.pictures[number].load())


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_a_run_cut_off_anywhere_is_reported_as_far_as_it_came(
    recorded: Path, tmp_path: Path, share: float
) -> None:
    run_dir = copy_of(recorded, tmp_path / "killed", without=("summary.json",))
    log = log_bytes(recorded)
    (run_dir / LOG_NAME).write_bytes(log[: int(share * len(log))])
    result = rig("report", str(run_dir))
    assert result.exit_code == 0, result.stderr
    assert "cut off" in result.stderr
    assert "no radius" in (run_dir / "report.html").read_text()


def test_runs_are_listed_newest_first_whatever_became_of_them(
    recorded: Path, tmp_path: Path
) -> None:
    whole = copy_of(recorded, tmp_path / "whole")
    killed = copy_of(recorded, tmp_path / "killed", without=("summary.json",))
    setup = json.loads((killed / "setup.json").read_text())
    (killed / "setup.json").write_text(json.dumps({**setup, "started_at": "20990101-000000"}))
    half = copy_of(recorded, tmp_path / "half")
    (half / "summary.json").write_text('{"radius_m": 0.0')
    (half / "setup.json").write_text(json.dumps({**setup, "started_at": "20010101-000000"}))
    never = tmp_path / "never"
    never.mkdir()
    (never / "config.yaml").touch()
    os.utime(never, (0, 0))
    (tmp_path / "no-run").mkdir()
    result = rig("runs", str(tmp_path), "--json")
    listed = json.loads(result.stdout)
    assert [Path(run["run_dir"]).name for run in listed] == ["killed", "whole", "half", "never"]
    assert [run["ending"] for run in listed] == [
        *("cut off", "duration reached", "cut off", "never began")
    ]
    summary = json.loads((whole / "summary.json").read_text())
    assert listed[1]["radius_m"] == summary["radius_m"]
    assert listed[1]["relative_error"] == summary["relative_error"]
    assert listed[0]["radius_m"] is None
    assert f"{1e3 * summary['radius_m']:.4f} mm" in rig("runs", str(tmp_path)).stdout


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda run: (run / "setup.json").unlink(), "setup.json"),
        (lambda run: (run / "setup.json").write_text("{}"), "setup.json"),
        (lambda run: (run / LOG_NAME).unlink(), LOG_NAME),
        (lambda run: (run / LOG_NAME).write_text("no log"), LOG_NAME),
        (lambda run: (run / LOG_NAME).write_bytes(b""), LOG_NAME),
    ],
)
def test_a_directory_that_cannot_be_read_is_refused_with_the_file_named(
    recorded: Path, tmp_path: Path, spoil, words: str
) -> None:
    run_dir = copy_of(recorded, tmp_path / "run")
    spoil(run_dir)
    result = rig("report", str(run_dir))
    assert result.exit_code == 2
    assert words in result.stderr


def test_directories_that_do_not_exist_are_refused(tmp_path: Path) -> None:
    assert rig("report", str(tmp_path / "nothing")).exit_code == 2
    assert rig("runs", str(tmp_path / "nothing")).exit_code == 2


def test_an_estimators_own_deviation_goes_before_a_judged_one(tmp_path: Path) -> None:
    observed = tmp_path / "observed"
    record(observed, "--set", "estimator.kind=observer")
    run = read_run(observed)
    judged = error_bar(run)
    assert judged is not None and judged.meaning == JUDGED
    off_m = abs(run.summary["radius_m"] - run.summary["radius_true_m"])
    assert 0.3 * off_m < judged.plus_minus_m < 10.0 * off_m  # after 1.5 s the guess still shows
    run_dir = copy_of(observed, tmp_path / "stated")
    summary = {**run.summary, "radius_std_m": 1.5e-5}
    (run_dir / "summary.json").write_text(json.dumps(summary))
    stated = error_bar(read_run(run_dir))
    assert stated is not None and (stated.plus_minus_m, stated.meaning) == (1.5e-5, STATED)
    (run_dir / "summary.json").write_text(json.dumps({**summary, "radius_m": None}))
    assert error_bar(read_run(run_dir)) is None


def test_every_name_tells_runs_apart(recorded: Path, tmp_path: Path) -> None:
    for parent in ("first", "second"):
        (tmp_path / parent).mkdir()
        copy_of(recorded, tmp_path / parent / "run")
    out = tmp_path / "out"
    runs = (str(tmp_path / "first" / "run"), str(tmp_path / "second" / "run"))
    assert rig("report", *runs, runs[0], "--out", str(out)).exit_code == 0
    page = (out / "report.html").read_text()
    assert np.all([name in page for name in ("run (1)", "run (2)", "run (3)")])
