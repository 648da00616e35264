"""Which calibration a run uses, and which it refuses."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.errors import ConfigError
from rig.calibrated import calibrated, calibration_path, with_nominal
from rig.calibration.result import save_calibration
from rig.config import RigConfig
from rig.config_load import load_config
from sim_backend import drawings
from sim_backend.config import SimConfig
from tests.rig.made_calibration import calibration_of


def config(*assignments: str) -> RigConfig:
    return load_config("sphere", None, list(assignments))


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_without_a_file_the_device_s_own_values_hold() -> None:
    rig = config()
    assert calibrated(rig) == (rig, "the device's own")


def test_the_file_goes_before_given_values() -> None:
    rig = config("calibration.latency_s=0.9")
    save_calibration(calibration_of(rig), calibration_path(rig))
    used, source = calibrated(rig)
    assert source == "calibration/sim.yaml"
    assert used.calibration.intrinsics is not None
    assert used.calibration.intrinsics.fx_px == 790.0
    assert used.calibration.tool_camera_xyz_m == (0.01, 0.02, 0.03)
    assert used.calibration.latency_s == 0.05


def test_a_file_that_is_named_must_be_there() -> None:
    with pytest.raises(ConfigError, match="rig calibrate"):
        calibrated(config("calibration.file=elsewhere.yaml"))


def test_a_failed_calibration_is_refused_with_its_reasons() -> None:
    rig = config()
    save_calibration(calibration_of(rig, passed=False), calibration_path(rig))
    with pytest.raises(ConfigError, match=r"held-out error.*--uncalibrated"):
        calibrated(rig)


def test_a_calibration_of_another_setup_is_refused_with_the_step_to_repeat() -> None:
    rig = config()
    save_calibration(calibration_of(rig), calibration_path(rig))
    with pytest.raises(ConfigError, match="rig calibrate intrinsics"):
        calibrated(config("sim.camera.width=1280", "sim.camera.height=960"))


def test_another_board_in_the_configuration_does_not_matter_to_a_run() -> None:
    rig = config()
    save_calibration(calibration_of(rig), calibration_path(rig))
    calibrated(config("calibration.board.square_m=0.04", "calibration.board.marker_m=0.03"))


def test_the_calibration_of_another_rig_is_refused() -> None:
    rig = config()
    other = calibration_of(rig).model_copy(update={"rig": "other"})
    save_calibration(other, calibration_path(rig))
    with pytest.raises(ConfigError, match="rig other"):
        calibrated(rig)


def test_uncalibrated_takes_the_drawings_of_the_simulated_rig_never_its_truth() -> None:
    rig = config("sim.T_tool_camera=[0.1,0,0,0,0,0]", "sim.camera.fx=700", "sim.camera.fy=700")
    save_calibration(calibration_of(rig), calibration_path(rig))
    used, source = calibrated(rig, uncalibrated=True)
    assert "nominal" in source
    assert used == with_nominal(rig)
    assert used.calibration.intrinsics is not None
    assert used.calibration.intrinsics.fx_px == drawings.FOCAL_PX
    assert used.calibration.tool_camera_xyz_m == drawings.T_TOOL_CAMERA[:3]


def test_the_drawings_are_a_little_wrong_and_a_run_does_not_need_them() -> None:
    drawn, built = np.array(drawings.T_TOOL_CAMERA), np.array(SimConfig().T_tool_camera)
    turn = Rotation.from_rotvec(drawn[3:]).inv() * Rotation.from_rotvec(built[3:])
    assert 0.005 < np.linalg.norm(drawn[:3] - built[:3]) < 0.015
    assert 1.0 < np.degrees(turn.magnitude()) < 5.0
    assert 0.01 < abs(drawings.FOCAL_PX / SimConfig().camera.focal_px - 1.0) < 0.05
    assert calibrated(config())[0].calibration.intrinsics is None  # the factory's hold
