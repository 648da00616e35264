"""``rig calibrate`` through the true drivers, against an emulated arm and camera, in real time."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.config_load import packaged_config
from tests.rig.command_line import rig
from tests.rig.loopback_served import ArmKind, Served, served

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

# What the emulated rig is built with (sim.camera, sim.T_tool_camera); small pictures.
FOCAL_PX, CENTRE_PX = 400.0, (159.5, 119.5)
T_TOOL_CAMERA = [0.03, -0.02, 0.06, 0.10, -0.08, 0.12]
# Where calibrating starts: 14 mm, 3.4° and 4 % away.
NOMINAL = (
    "calibration.nominal.intrinsics={fx_px: 385, fy_px: 385, cx_px: 164, cy_px: 116}",
    "calibration.nominal.tool_camera_xyz_m=[0.037,-0.012,0.068]",
    "calibration.nominal.tool_camera_rotvec_rad=[0.13,-0.05,0.10]",
)
# A host that does other things too.
PATIENT = ("safety.max_state_age_s=0.5", "calibration.plan.poses=16")


@pytest.fixture(params=["ur", "grbl"])
def emulated(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Served]:
    arm: ArmKind = request.param
    if arm == "ur":
        pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    with served(arm, tmp_path, for_s=1800.0, target="board") as running:
        yield running


def test_the_truth_is_found_through_the_true_drivers(
    emulated: Served, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    name = "loopback_ur5e.yaml" if emulated.arm == "ur" else "loopback_gantry.yaml"
    host = "arm.host=" + emulated.host if emulated.arm == "ur" else f"arm.port={emulated.link}"
    own = ("arm.max_state_age_s=0.5",) if emulated.arm == "ur" else ()
    settings = (*NOMINAL, *PATIENT, *own, host, f"camera.source={emulated.stream}")
    done = rig(
        *("calibrate", "--json", "--rig", str(packaged_config(name))),
        *(f"--set={one}" for one in settings),
    )
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    print(emulated.arm, done.stdout)
    lens, place = found["intrinsics"], found["hand_eye"]["T_tool_camera"]
    assert lens["fx"] == pytest.approx(FOCAL_PX, rel=1e-3)
    assert lens["fy"] == pytest.approx(FOCAL_PX, rel=1e-3)
    assert [lens["cx"], lens["cy"]] == pytest.approx(CENTRE_PX, abs=1.0)
    assert place[:3] == pytest.approx(T_TOOL_CAMERA[:3], abs=5e-4)
    turn = Rotation.from_rotvec(place[3:]).inv() * Rotation.from_rotvec(T_TOOL_CAMERA[3:])
    assert np.degrees(turn.magnitude()) < 0.1
    # The stream's stamps are those of the exposures.
    assert abs(found["stamp_late_s"]) < 5e-3
    assert found["verdict"] == "passed"
