"""Which calibration a run uses, and which it refuses."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.errors import ConfigError
from rig.calibrated import NotCalibratedError, calibrated
from rig.calibration.result import save_calibration
from rig.calibration_place import calibration_path
from rig.config import RigConfig
from rig.config_load import load_config, packaged_config
from rig.records import write_config
from rig.start_values import with_nominal
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
    used = calibrated(rig)
    assert used.config == rig and used.source == "the device's own" and used.file is None


def test_the_file_goes_before_given_values() -> None:
    rig = config("calibration.latency_s=0.9")
    save_calibration(calibration_of(rig), calibration_path(rig))
    found = calibrated(rig)
    assert found.source == "calibration/sim.yaml" == str(found.path)
    used = found.config
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
    found = calibrated(rig, uncalibrated=True)
    assert "nominal" in found.source and found.file is None
    used = found.config
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
    assert calibrated(config()).config.calibration.intrinsics is None  # the factory's hold


REAL = (
    "name: lab\ncamera: {driver: opencv, source: /dev/video7}\narm: {driver: ur, host: 192.0.2.1}\n"
)
ROUGH = (
    "intrinsics: {fx_px: 800, fy_px: 800, cx_px: 319.5, cy_px: 239.5}, "
    "tool_camera_xyz_m: [0, 0, 0.05], tool_camera_rotvec_rad: [0, 0, 0]"
)


def real(folder: Path, calibration: str = "") -> tuple[RigConfig, Path]:
    """A rig file of real devices in ``folder``, read."""
    folder.mkdir(exist_ok=True)
    path = folder / "lab.yaml"
    path.write_text(f"{REAL}calibration: {{{calibration}}}\n", encoding="utf-8")
    return load_config("sphere", path), path


@pytest.mark.parametrize(
    "calibration", ["", f"nominal: {{{ROUGH}}}", ROUGH.partition(", tool")[0] + ", obtained: maker"]
)
def test_a_real_rig_without_a_calibration_is_refused_with_what_to_type(
    here: Path, calibration: str
) -> None:
    config, path = real(here, calibration)
    with pytest.raises(NotCalibratedError, match=rf"rig calibrate --rig {path}"):
        calibrated(config, path)


def test_values_that_nobody_vouches_for_are_no_calibration_of_a_real_rig(here: Path) -> None:
    config, path = real(here, ROUGH)
    with pytest.raises(NotCalibratedError, match=r"calibration\.nominal.*calibration\.obtained"):
        calibrated(config, path)


def test_values_that_were_measured_elsewhere_are_used_and_said(here: Path) -> None:
    config, path = real(here, f"{ROUGH}, obtained: 'ViSP, in May'")
    used = calibrated(config, path)
    assert used.config == config
    assert used.source == "given in the rig file: ViSP, in May"


def test_a_real_rig_runs_on_nominal_values_only_when_told_to(here: Path) -> None:
    config, path = real(here, f"nominal: {{{ROUGH}, latency_s: 0.03}}")
    used = calibrated(config, path, uncalibrated=True).config.calibration
    assert used.intrinsics is not None and used.intrinsics.fx_px == 800.0
    assert used.tool_camera_xyz_m == (0.0, 0.0, 0.05) and used.latency_s == 0.03
    config, path = real(here)
    with pytest.raises(NotCalibratedError, match=r"nominal.*intrinsics.*rig calibrate --rig"):
        calibrated(config, path, uncalibrated=True)


def test_a_calibration_is_found_beside_its_rig_file_from_any_directory(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config, path = real(here / "rigs")
    assert calibration_path(config, path) == here / "rigs" / "calibration" / "lab.yaml"
    save_calibration(calibration_of(config), calibration_path(config, path))
    (here / "elsewhere").mkdir()
    monkeypatch.chdir(here / "elsewhere")
    assert calibrated(config, path).path == here / "rigs" / "calibration" / "lab.yaml"
    # One in the working directory does not take its place.
    save_calibration(calibration_of(config, passed=False), Path("calibration/lab.yaml"))
    assert calibrated(config, path).path == here / "rigs" / "calibration" / "lab.yaml"


def test_or_in_the_working_directory_where_there_is_none_beside_it(here: Path) -> None:
    config, path = real(here / "rigs")
    save_calibration(calibration_of(config), Path("calibration/lab.yaml"))
    assert calibrated(config, path).source == "calibration/lab.yaml"


def test_nothing_is_put_beside_the_rig_files_of_the_program() -> None:
    path = packaged_config("loopback_ur5e.yaml")
    config = load_config("sphere", path)
    assert calibration_path(config, path) == Path("calibration/loopback_ur5e.yaml")
    assert "emulated" in calibrated(config, path).source


def test_what_a_run_keeps_of_its_configuration_can_be_run_again_and_says_where_it_is_from(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config, path = real(here / "rigs")
    save_calibration(calibration_of(config), calibration_path(config, path))
    write_config(here, calibrated(config, path).config)
    again = load_config("sphere", here / "config.yaml")
    used = calibrated(again, here / "config.yaml")
    assert used.source == "given in the rig file: rig calibrate, 2026-01-01"
    assert used.config.calibration.latency_s == 0.05


def test_nominal_values_go_before_all_others_where_a_calibration_starts(here: Path) -> None:
    config, _ = real(
        here,
        f"{ROUGH}, nominal: {{tool_camera_xyz_m: [0, 0, 0.2], "
        "tool_camera_rotvec_rad: [0, 0, 1]}, tcp_offset: [0, 0, 0.1, 0, 0, 0]",
    )
    start = with_nominal(config).calibration
    assert start.intrinsics == config.calibration.intrinsics
    assert start.tool_camera_xyz_m == (0.0, 0.0, 0.2)
    assert start.tcp_offset is None
