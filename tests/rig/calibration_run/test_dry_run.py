"""``rig calibrate --dry-run``: what would be done, in words and as a picture; nothing is opened."""

import json
from pathlib import Path

import numpy as np
import pytest

from drivers.ur.kinematics import MODELS, Kinematics
from rig import build
from rig.calibration_run.joints_ahead import ur_joints
from rig.config_devices import UrModel
from tests.rig.calibration_run.small_rig import calibrate, failing
from tests.rig.command_line import Outcome, rig

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


LAB = """
name: lab
camera: {driver: opencv, source: /dev/video7, width: 640, height: 480}
arm: {driver: ur, host: 192.168.0.100}
calibration:
  intrinsics: {fx_px: 800, fy_px: 800, cx_px: 319.5, cy_px: 239.5}
  tool_camera_xyz_m: [0.03, -0.02, 0.06]
  tool_camera_rotvec_rad: [0, 0, 0]
  plan: {poses: 10}
safety: {workspace_min_m: [-2.0, -2.0, 0.05]}
"""


def lab(here: Path, *settings: str) -> Outcome:
    (here / "lab.yaml").write_text(LAB, encoding="utf-8")
    sets = (f"--set={one}" for one in settings)
    return rig("calibrate", "--dry-run", "--json", "--rig", "lab.yaml", *sets)


@pytest.mark.parametrize(
    "model",
    [
        "UR5e",
        pytest.param("UR3e", marks=pytest.mark.slow),
        pytest.param("UR10e", marks=pytest.mark.slow),
    ],
)
def test_a_ur_s_plan_keeps_within_its_reach_and_off_its_singularities(
    here: Path, model: UrModel
) -> None:
    done = lab(here, f"arm.model={model}", "sim.board.position_m=[0.3,-0.1,0.03]")
    assert done.exit_code == 0, done.stderr
    assert f"singularities of a {model}" in done.stderr
    kinematics = Kinematics(next(one for one in MODELS if one.name == model), (0.0,) * 6)
    poses = [np.array(pose["T_base_tool"]) for pose in json.loads(done.stdout)["poses"]]
    for T in poses:
        joints = ur_joints(kinematics, T)
        assert joints is not None
        assert kinematics.tool_pose(joints.q) == pytest.approx(T, abs=1e-6)


def test_a_first_look_out_of_a_ur_s_reach_is_said(here: Path) -> None:
    done = lab(here, "arm.model=UR3e", "sim.board.position_m=[0.9,-0.13,0.03]")
    assert "a UR3e does not get to this first look" in done.stderr


def test_an_unknown_model_lists_the_known_ones(here: Path) -> None:
    done = lab(here, "arm.model=UR7")
    assert done.exit_code == 2
    assert "UR5e" in done.stderr and "UR10e" in done.stderr


def test_a_plan_without_room_says_what_to_widen() -> None:
    done = calibrate("--dry-run", settings=("calibration.plan.limits.max_turn_rad=0.02",))
    assert done.exit_code == 6
    assert "widen" in done.stderr


def test_a_picture_that_cannot_be_written_is_said(here: Path) -> None:
    (here / "calibration").write_text("in the way", encoding="utf-8")
    done = calibrate("--dry-run")
    assert done.exit_code == 2
    assert "cannot write" in done.stderr
