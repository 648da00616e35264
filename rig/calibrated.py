"""Which calibration a run uses: the file of `rig calibrate`, measured values, or nominal ones."""

from dataclasses import dataclass
from pathlib import Path

from rig.build import is_simulated
from rig.calibration.errors import UnusableCalibrationError
from rig.calibration.result import CalibrationFile, IntrinsicsResult, load_calibration
from rig.calibration.result_check import check_usable
from rig.calibration_place import calibration_path
from rig.config import RigConfig
from rig.config_calibration import IntrinsicsConfig
from rig.fingerprints import fingerprints
from rig.start_values import replaced, with_nominal
from rig.tcp_offset import tcp_of


class NotCalibratedError(UnusableCalibrationError):
    """A real rig of which nobody has measured what a run must know; nothing was opened."""


@dataclass(frozen=True, slots=True)
class Calibrated:
    """A configuration with the geometry to use."""

    config: RigConfig
    source: str  # where that geometry is from, in words
    file: CalibrationFile | None = None  # where it is from `rig calibrate`
    path: Path | None = None


def calibrated(
    config: RigConfig, rig_file: Path | None = None, uncalibrated: bool = False
) -> Calibrated:
    """The geometry to use for ``config``, which was read from ``rig_file``.

    The calibration's file goes before given values; without either a simulated rig's factory
    values hold. Raises NotCalibratedError for a real rig without a file whose rig file does not
    say that its values were measured, UnusableCalibrationError for a calibration that is named but
    missing, failed or out of date.
    """
    if uncalibrated:
        nominal = with_nominal(config)
        if missing := _missing(nominal):
            raise NotCalibratedError(
                f"--uncalibrated takes the values under calibration.nominal, and {missing} there "
                f"is not given. Better: {_command(rig_file)}"
            )
        return Calibrated(nominal, "nominal values (--uncalibrated)")
    path = calibration_path(config, rig_file)
    if config.calibration.file is None and not path.exists():
        return Calibrated(config, _given(config, path, rig_file))
    found = load_calibration(path)
    if found.rig != config.name:
        raise UnusableCalibrationError(
            f"{path} is the calibration of the rig {found.rig}, not {config.name}"
        )
    # The board only matters for calibrating: another one in the configuration changes nothing.
    now = {key: value for key, value in fingerprints(config).items() if key != "board"}
    check_usable(found, now, path)
    return Calibrated(_with_values(config, found), str(path), found, path)


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


def _given(config: RigConfig, path: Path, rig_file: Path | None) -> str:
    """Where the geometry is from without a calibration's file."""
    given, where = config.calibration, rig_file or "the rig file"
    if is_simulated(config):
        return "the device's own" if given.intrinsics is None else "given in the rig file"
    if _missing(config):
        raise NotCalibratedError(
            f"{config.name} is not calibrated: there is no {path}. Make it: {_command(rig_file)}"
        )
    if given.obtained is None:
        raise NotCalibratedError(
            f"{config.name} is not calibrated: there is no {path}, and {where} does not say how "
            "its calibration.intrinsics and tool_camera_* were obtained. Guesses belong under "
            f"calibration.nominal; then {_command(rig_file)}. Measured values need a word on how "
            'and when: calibration.obtained: "…"'
        )
    return f"given in the rig file: {given.obtained}"


def _missing(config: RigConfig) -> str:
    """What no real rig can do without and ``config`` does not have; "" when all is there."""
    given = config.calibration
    if is_simulated(config) or None not in (given.intrinsics, given.tool_camera_xyz_m):
        return ""
    return "intrinsics" if given.intrinsics is None else "tool_camera_xyz_m and _rotvec_rad"


def _command(rig_file: Path | None) -> str:
    return "rig calibrate" + ("" if rig_file is None else f" --rig {rig_file}")


def _with_values(config: RigConfig, found: CalibrationFile) -> RigConfig:
    """``config`` with the file's values; the check before has made sure that they are there."""
    lens, hand_eye, latency = found.intrinsics, found.hand_eye, found.latency
    assert lens is not None
    assert hand_eye is not None
    assert latency is not None
    return replaced(
        config,
        {
            "obtained": f"rig calibrate, {found.made}",
            "intrinsics": intrinsics_config(lens),
            "tool_camera_xyz_m": hand_eye.tool_camera_xyz_m,
            "tool_camera_rotvec_rad": hand_eye.tool_camera_rotvec_rad,
            "tcp_offset": tcp_of(hand_eye.depends_on),
            "latency_s": latency.latency_s,
            "row_time_s": latency.row_time_s,
        },
    )
