"""``rig calibrate --dry-run``: what would be done, in words and as a picture; nothing is opened."""

import json
from pathlib import Path

import numpy as np
import pytest

from rig import build
from tests.rig.calibration_run.small_rig import calibrate, failing
from tests.rig.command_line import rig

BOX = ("safety.workspace_min_m=[-0.2,-0.2,0.4]", "safety.workspace_max_m=[0.2,0.2,0.9]")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("open_camera", "open_arm", "open_simulated"):
        monkeypatch.setattr(build, name, failing(AssertionError("a device was opened")))
    return tmp_path


def test_the_plan_is_drawn_and_told_and_keeps_within_the_workspace(here: Path) -> None:
    done = calibrate("--dry-run", "--json", settings=BOX)
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    tools = np.array([pose["T_base_tool"] for pose in told["poses"]])[:, :3, 3]
    assert len(tools) == 9  # and the first look
    assert np.all(tools[:, :2] >= -0.2) and np.all(tools[:, :2] <= 0.2)
    assert (here / told["file"]).read_bytes().startswith(b"\x89PNG")
    assert "within the joints' ranges" in done.stderr
    assert "adds" in done.stderr


def test_a_real_rig_is_planned_without_its_devices(here: Path) -> None:
    (here / "lab.yaml").write_text(
        "name: lab\ncamera: {driver: opencv, source: /dev/video7, width: 640, height: 480}\n"
        "arm: {driver: ur, host: 192.168.0.100}\n"
        "calibration:\n  intrinsics: {fx_px: 800, fy_px: 800, cx_px: 319.5, cy_px: 239.5}\n"
        "  tool_camera_xyz_m: [0.03, -0.02, 0.06]\n  tool_camera_rotvec_rad: [0, 0, 0]\n"
        "  plan: {poses: 10}\n"
        "sim: {board: {position_m: [0.45, -0.13, 0.03]}}\n",
        encoding="utf-8",
    )
    done = rig("calibrate", "--dry-run", "--rig", "lab.yaml")
    assert done.exit_code == 0, done.stderr
    assert "as the simulated rig has it: the board at [0.45, -0.13, 0.03] m" in done.stderr
    assert "joints are checked when the arm is connected" in done.stderr
    assert (here / "calibration" / "lab-plan.png").exists()


def test_a_plan_without_room_says_what_to_widen() -> None:
    done = calibrate("--dry-run", settings=("calibration.plan.limits.max_turn_rad=0.02",))
    assert done.exit_code == 6
    assert "widen" in done.stderr


def test_a_picture_that_cannot_be_written_is_said(here: Path) -> None:
    (here / "calibration").write_text("in the way", encoding="utf-8")
    done = calibrate("--dry-run")
    assert done.exit_code == 2
    assert "cannot write" in done.stderr
