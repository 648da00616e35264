"""A calibration that is cut short: the arm rests, what it has is kept, ``--resume`` goes on."""

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.errors import OperateError
from rig.calibration_run import fits, session, store
from rig.calibration_run.collector import Collector
from rig.calibration_run.errors import PoseRefusedError
from rig.calibration_run.mover import Mover
from rig.calibration_run.stills import Photographer
from sim_backend.arm import SimulatedArm
from sim_backend.camera import SimulatedCamera
from tests.rig.calibration_run.small_rig import at_call, calibrate, ctrl_c, failing

LOST = OperateError("camera sim: it was unplugged; plug it in")
REFUSED = PoseRefusedError("the arm stopped 80.0 mm and 3.0° before the pose: joint spin max")


def stills(folder: Path) -> int:
    return len(list((folder / "calibration" / "sim-data").glob("still-*.npz")))


@pytest.fixture(scope="module")
def collected(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A calibration's stills, collected in three goes with trouble in every one."""
    before, path = Path.cwd(), tmp_path_factory.mktemp("bench")
    os.chdir(path)
    with pytest.MonkeyPatch.context() as patch:
        at_call(patch, Photographer, "take", 4, ctrl_c)
        done = calibrate("hand-eye")
    assert done.exit_code == 130, done.stderr
    assert f"kept: {stills(path)} poses" in done.stderr and "--resume" in done.stderr
    assert stills(path) == 3

    with pytest.MonkeyPatch.context() as patch:
        at_call(patch, Photographer, "take", 5, failing(LOST))
        done = calibrate("hand-eye", "--resume")
    assert done.exit_code == 3
    assert "unplugged" in done.stderr and "--resume" in done.stderr
    # One look checked that the board stands where it stood.
    assert stills(path) == 6

    with pytest.MonkeyPatch.context() as patch:
        at_call(patch, Mover, "go_to", 3, failing(REFUSED))
        done = calibrate("hand-eye", "--resume", "--json")
    assert done.exit_code == 0, done.stderr
    assert "skipped: the arm stopped" in done.stderr
    assert stills(path) == 10
    assert json.loads(done.stdout)["hand_eye"]["T_tool_camera"][0] == pytest.approx(0.03, abs=5e-4)
    yield path
    os.chdir(before)


@pytest.fixture
def here(collected: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(collected / "calibration", tmp_path / "calibration")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_ctrl_c_in_a_motion_stops_the_arm(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    moving = at_call(monkeypatch, SimulatedArm, "command_twist", 90, ctrl_c)
    stops = at_call(monkeypatch, SimulatedArm, "stop", 0, ctrl_c)
    done = calibrate("latency")
    assert done.exit_code == 130
    assert moving[0] <= 92  # at the next tick
    assert stops[0] >= 1
    assert stills(here) == 10


def test_ctrl_c_in_a_fit_ends_it_at_once(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    at_call(monkeypatch, fits, "fit_intrinsics", 1, ctrl_c)
    after = at_call(monkeypatch, fits, "solve_hand_eye", 0, ctrl_c)
    before = (here / "calibration" / "sim.yaml").read_bytes()
    done = calibrate("hand-eye", "--resume")
    assert done.exit_code == 130
    assert after[0] == 0
    assert "kept: 10 poses" in done.stderr
    assert (here / "calibration" / "sim.yaml").read_bytes() == before


def test_ctrl_c_while_the_result_is_written_leaves_a_whole_file(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (here / "calibration" / "sim.yaml").unlink()
    at_call(monkeypatch, session, "save_calibration", 1, ctrl_c)
    done = calibrate("hand-eye", "--resume")
    assert done.exit_code == 130
    assert "T_tool_camera" not in done.stdout
    assert "hand_eye:" in (here / "calibration" / "sim.yaml").read_text(encoding="utf-8")
    assert calibrate("hand-eye", "--resume").exit_code == 0


def test_a_disk_that_fills_up_ends_it_with_what_is_there(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in (8, 9):
        for path in (here / "calibration" / "sim-data").glob(f"still-{number:03d}.*"):
            path.unlink()
    at_call(monkeypatch, store, "_replace", 4, failing(OSError(28, "No space left on device")))
    done = calibrate("hand-eye", "--resume")
    assert done.exit_code == 2
    assert "cannot write" in done.stderr and "No space left" in done.stderr
    assert "kept: 9 poses" in done.stderr


def test_a_camera_that_falls_silent_in_a_wiggle_is_a_failing_device(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read, calls = SimulatedCamera.read, [0]

    def silent(camera: SimulatedCamera, timeout_s: float) -> object:
        calls[0] += 1
        return read(camera, timeout_s) if calls[0] < 60 else None

    monkeypatch.setattr(SimulatedCamera, "read", silent)
    done = calibrate("latency")
    assert done.exit_code == 3
    assert "no picture for" in done.stderr and "wiggle" in done.stderr


def test_a_board_moved_since_is_not_mixed_with_what_was_seen_before(here: Path) -> None:
    for path in (here / "calibration" / "sim-data").glob("still-009.*"):
        path.unlink()
    done = calibrate("hand-eye", "--resume", settings=("sim.board.position_m=[0.01,0.0,0.3]",))
    assert done.exit_code == 6
    assert "was moved since" in done.stderr


def test_data_that_cannot_be_read_are_not_resumed(here: Path) -> None:
    (here / "calibration" / "sim-data" / "still-004.npz").write_bytes(b"PK\x03\x04 half of it")
    done = calibrate("hand-eye", "--resume")
    assert done.exit_code == 2
    assert "cannot be read" in done.stderr


def test_nothing_of_before_is_lost_until_there_is_something_new(here: Path) -> None:
    done = calibrate("hand-eye", settings=("sim.board.visible=false",))
    assert done.exit_code == 6
    assert stills(here) == 10


def test_a_collector_that_is_stopped_says_so_before_the_first_still(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    at_call(monkeypatch, Collector, "first_look", 1, ctrl_c)
    done = calibrate("hand-eye")
    assert done.exit_code == 130
    assert "kept" not in done.stderr
