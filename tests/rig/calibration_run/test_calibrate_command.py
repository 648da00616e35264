"""``rig calibrate`` on the simulated rig: finds a hidden truth, and says what is wrong."""

import json
import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from rig import calibration_limits
from rig.log.lines import lines
from rig.log.reader import open_log
from tests.rig.command_line import Outcome, rig

SMALL = [
    "calibration.plan.poses=12",
    "calibration.plan.verify_poses=2",
    "calibration.plan.segment_s=3",
    "sim.renderer=raster",
]
T_TOOL_CAMERA = [0.042, -0.012, 0.052, 0.15, -0.05, 0.15]  # up to 12 mm and 4° from the drawings
TRUTH = [
    f"sim.T_tool_camera={T_TOOL_CAMERA}",
    "sim.camera.fx=775",
    "sim.camera.fy=775",
    "sim.camera.cx=325",
    "sim.camera.cy=236",
    "sim.camera.latency_s=0.075",
    "sim.camera.stamps=arrival",
]

SETTINGS = [f"--set={s}" for s in [*TRUTH, SMALL[-1]]]


def calibrate(*steps: str, settings: list[str]) -> Outcome:
    return rig("calibrate", *steps, "--json", *[f"--set={s}" for s in [*SMALL, *settings]])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A working directory with the calibration of a rig whose truth is hidden."""
    before, path = Path.cwd(), tmp_path_factory.mktemp("bench")
    os.chdir(path)
    done = calibrate(settings=TRUTH)
    (path / "out.json").write_text(done.stdout, encoding="utf-8")
    assert done.exit_code == 0, done.stderr
    yield path
    os.chdir(before)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_hidden_truth_is_found(folder: Path) -> None:
    found = json.loads((folder / "out.json").read_text(encoding="utf-8"))
    lens, place = found["intrinsics"], found["hand_eye"]
    assert lens["fx"] == pytest.approx(775, rel=1e-3)
    assert lens["fy"] == pytest.approx(775, rel=1e-3)
    assert [lens["cx"], lens["cy"]] == pytest.approx([325, 236], abs=0.5)
    T = place["T_tool_camera"]
    assert T[:3] == pytest.approx(T_TOOL_CAMERA[:3], abs=3e-4)
    turn = Rotation.from_rotvec(T[3:]).inv() * Rotation.from_rotvec(T_TOOL_CAMERA[3:])
    assert np.degrees(turn.magnitude()) < 0.05
    assert found["latency_s"] == pytest.approx(0.075, abs=1.5e-3)
    assert found["stamp_late_s"] == pytest.approx(0.075, abs=2e-4)
    assert found["latency_std_s"] < 1e-3
    assert found["held_out_px"] < 0.08
    assert found["verdict"] == "passed"
    assert (folder / found["file"]).exists()


def test_the_report_shows_every_step(folder: Path) -> None:
    found = json.loads((folder / "out.json").read_text(encoding="utf-8"))
    text = (folder / found["report"]).read_text(encoding="utf-8")
    assert text.count("data:image/png;base64,") == 5
    assert "passed" in text


def test_a_run_takes_the_calibration_and_measures_the_ball(folder: Path) -> None:
    done = rig("run", "--target", "sphere", "--json", *SETTINGS)
    assert done.exit_code == 0, done.stderr
    assert "calibration: calibration/sim.yaml" in done.stderr
    summary = json.loads(done.stdout)
    assert abs(summary["relative_error"]) < 3e-3
    assert 1e-8 < summary["radius_calibration_std_m"] < 5e-5
    assert set(summary["radius_calibration_parts_m"]) >= {"hand_eye", "focal_length", "latency"}
    assert "the calibration limits it to" in done.stderr


@pytest.mark.parametrize("trouble", [KeyboardInterrupt(), ValueError("not to be solved")])
def test_a_run_s_result_does_not_wait_for_what_limits_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, trouble: BaseException
) -> None:
    out = folder / f"limits-{type(trouble).__name__}"

    def fail(*_: object) -> None:
        assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["radius_m"] > 0.0
        raise trouble

    monkeypatch.setattr(calibration_limits, "calibration_limits", fail)
    short = ["--duration", "1.0", "--no-report", "--out", str(out)]
    done = rig("run", "--target", "sphere", "--json", *short, *SETTINGS)
    assert done.exit_code == 0, done.stderr
    assert "what the calibration limits the radius to" in done.stderr
    summary = json.loads(done.stdout)
    assert summary["radius_m"] > 0.0 and summary["radius_calibration_std_m"] is None
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["frames"] > 20


def test_without_it_the_radius_is_off_by_far_more(folder: Path) -> None:
    done = rig("run", "--target", "sphere", "--uncalibrated", "--json", *SETTINGS)
    assert done.exit_code == 0, done.stderr
    summary = json.loads(done.stdout)
    assert abs(summary["relative_error"]) > 9e-3
    assert summary["radius_calibration_std_m"] is None


def test_an_interrupted_calibration_goes_on_with_what_it_has(folder: Path) -> None:
    (folder / "calibration" / "sim-data" / "recording.npz").unlink()
    done = calibrate("latency", settings=TRUTH)
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["stamp_late_s"] == pytest.approx(0.075, abs=2e-4)


def test_a_row_s_time_is_found_where_asked_and_zero_for_a_global_shutter(folder: Path) -> None:
    saved = (folder / "calibration" / "sim.yaml").read_bytes()
    done = calibrate("latency", "--rolling-shutter", settings=TRUTH)
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    assert 0.0 < found["row_time_std_s"] < 1e-6
    assert abs(found["row_time_s"]) < 4.0 * found["row_time_std_s"]
    assert "row to row" in done.stderr
    (folder / "calibration" / "sim.yaml").write_bytes(saved)


@pytest.mark.slow
def test_a_rolling_shutter_s_row_time_is_found_and_used(here: Path) -> None:
    rolling = ["sim.camera.row_time_s=5e-5"]
    done = calibrate("--rolling-shutter", settings=rolling)
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    assert abs(found["row_time_s"] - 5e-5) < 4.0 * found["row_time_std_s"] < 2e-6
    run = rig("run", "--target", "sphere", "--json", *[f"--set={s}" for s in [*rolling, SMALL[-1]]])
    summary = json.loads(run.stdout)
    assert abs(summary["relative_error"]) < 1e-3
    used = yaml.safe_load((Path(summary["run_dir"]) / "config.yaml").read_text(encoding="utf-8"))
    assert used["calibration"]["row_time_s"] == pytest.approx(found["row_time_s"])


def test_what_a_calibration_saw_and_did_is_recorded(folder: Path) -> None:
    data = folder / "calibration" / "sim-data"
    log = open_log(data / "log-all.mcap")
    assert log.finished
    assert yaml.safe_load(log.attachments["sim.yaml"])["verdict"]["passed"]
    assert yaml.safe_load(log.attachments["config.yaml"])["sim"]["camera"]["fx"] == 775
    counts = Counter(record.kind for record in log.records())
    assert counts["image"] == counts["frame"] > 100
    assert counts["arm"] > 1000 and counts["command"] > 500
    events = [line["event"] for line in lines(log) if line["kind"] == "event"]
    for step in ("poses", "fit", "latency", "verification"):
        assert f"step {step}" in events
    stamps_ns = {record.t_ns for record in log.records(["image"])}
    with np.load(data / "still-003.npz") as still:
        assert round(still["stamps"][0] * 1e9) in stamps_ns
    replayed = rig("replay", str(data / "log-all.mcap"))
    assert replayed.exit_code == 2 and "'board'" in replayed.stderr


def test_nothing_to_resume_is_said(here: Path) -> None:
    done = calibrate("--resume", settings=[])
    assert done.exit_code == 2
    assert "nothing to resume: leave --resume out" in done.stderr


@pytest.mark.parametrize("step", ["latency", "verify"])
def test_a_step_before_its_turn_names_the_one_that_is_missing(here: Path, step: str) -> None:
    done = calibrate(step, settings=[])
    assert done.exit_code == 2
    assert "nothing to resume: run `rig calibrate hand-eye` first" in done.stderr


def test_a_board_of_any_size_has_markers_that_fit(here: Path) -> None:
    done = rig("calibrate", "board", "--square", "0.02")
    assert done.exit_code == 0
    assert "marker_m: 0.0147" in done.stdout
    refused = rig("calibrate", "board", "--square", "0.02", "--marker", "0.022")
    assert refused.exit_code == 2
    assert "this board cannot be: marker_m = 0.022 must be between" in refused.stderr


def test_the_board_is_printed_with_its_definition(here: Path) -> None:
    done = rig("calibrate", "board", "--paper", "a4")
    assert done.exit_code == 0
    assert (here / "board.pdf").read_bytes().startswith(b"%PDF")
    assert "squares" in done.stdout


@pytest.mark.parametrize("wrong", ["7", "7x", "axb", "2x2"])
def test_a_board_that_cannot_be_printed_is_refused(here: Path, wrong: str) -> None:
    done = rig("calibrate", "board", "--squares", wrong)
    assert done.exit_code == 2
    assert not (here / "board.pdf").exists()


def test_options_may_stand_before_the_step_too(here: Path) -> None:
    done = rig("calibrate", "--set", "sim.camera.width=wide", "latency")
    assert done.exit_code == 2
    assert "sim.camera.width" in done.stderr
