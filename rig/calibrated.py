"""Which calibration a run uses: the file of `rig calibrate`, given values, or nominal ones."""

from pathlib import Path

from drivers.errors import ConfigError
from rig.build import is_simulated
from rig.calibration.result import CalibrationFile, IntrinsicsResult, load_calibration
from rig.calibration.result_check import check_usable
from rig.config import RigConfig
from rig.config_calibration import CalibrationConfig, IntrinsicsConfig
from rig.fingerprints import fingerprints
from rig.tcp_offset import tcp_of
from sim_backend import drawings


def calibration_path(config: RigConfig) -> Path:
    """Where the rig's calibration is, or will be."""
    return Path(config.calibration.file or f"calibration/{config.name}.yaml")


def calibrated(config: RigConfig, uncalibrated: bool = False) -> tuple[RigConfig, str]:
    """The configuration with the geometry to use, and where that is from, in words.

    The calibration's file goes before given values; without either the device's own factory
    values hold. Raises ConfigError for a file that is named but missing, failed or out of date.
    """
    if uncalibrated:
        return with_nominal(config), "nominal values (--uncalibrated)"
    found = calibration_in_use(config)
    if found is None:
        given = config.calibration.intrinsics is not None
        return config, "given in the rig file" if given else "the device's own"
    return _with_values(config, found), str(calibration_path(config))


def calibration_in_use(config: RigConfig) -> CalibrationFile | None:
    """The rig's calibration; None when there is none and the configuration asks for none.

    Raises ConfigError for a file that is named but missing, failed or out of date.
    """
    path = calibration_path(config)
    if config.calibration.file is None and not path.exists():
        return None
    found = load_calibration(path)
    if found.rig != config.name:
        raise ConfigError(f"{path} is the calibration of the rig {found.rig}, not {config.name}")
    # The board only matters for calibrating: another one in the configuration changes nothing.
    now = {key: value for key, value in fingerprints(config).items() if key != "board"}
    check_usable(found, now, path)
    return found


def with_nominal(config: RigConfig) -> RigConfig:
    """The configuration with what is known without a calibration; simulated: its drawings.

    Values that the rig file gives stay.
    """
    if not is_simulated(config):
        return config
    camera, given = config.sim.camera, config.calibration
    values: dict[str, object] = {}
    if given.intrinsics is None:
        values["intrinsics"] = IntrinsicsConfig(
            fx_px=drawings.FOCAL_PX,
            fy_px=drawings.FOCAL_PX,
            cx_px=0.5 * (camera.width - 1),
            cy_px=0.5 * (camera.height - 1),
        )
    if given.tool_camera_xyz_m is None:
        values["tool_camera_xyz_m"] = drawings.T_TOOL_CAMERA[:3]
        values["tool_camera_rotvec_rad"] = drawings.T_TOOL_CAMERA[3:]
    return _replaced(config, values)


def _with_values(config: RigConfig, found: CalibrationFile) -> RigConfig:
    """``config`` with the file's values; the check before has made sure that they are there."""
    lens, hand_eye, latency = found.intrinsics, found.hand_eye, found.latency
    assert lens is not None
    assert hand_eye is not None
    assert latency is not None
    return _replaced(
        config,
        {
            "intrinsics": intrinsics_config(lens),
            "tool_camera_xyz_m": hand_eye.tool_camera_xyz_m,
            "tool_camera_rotvec_rad": hand_eye.tool_camera_rotvec_rad,
            "tcp_offset": tcp_of(hand_eye.depends_on),
            "latency_s": latency.latency_s,
            "row_time_s": latency.row_time_s,
        },
    )


def intrinsics_config(found: IntrinsicsResult) -> IntrinsicsConfig:
    """A calibration's intrinsics as a configuration has them."""
    return IntrinsicsConfig(
        fx_px=found.fx_px,
        fy_px=found.fy_px,
        cx_px=found.cx_px,
        cy_px=found.cy_px,
        distortion=found.distortion,
        image_size_px=(found.width, found.height),
    )


def _replaced(config: RigConfig, values: dict[str, object]) -> RigConfig:
    data = {**config.calibration.model_dump(), **values}
    return config.model_copy(update={"calibration": CalibrationConfig.model_validate(data)})
