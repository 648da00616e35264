"""What is known of a rig's geometry before it is calibrated: drawings, data sheets, guesses."""

import numpy as np
from numpy.typing import NDArray

from drivers.errors import ConfigError
from estimator.image.intrinsics import Intrinsics
from rig.build import is_simulated
from rig.calibration.pose_candidates import StartDoubt
from rig.config import RigConfig
from rig.config_calibration import CalibrationConfig, IntrinsicsConfig
from rig.given_values import hand_eye_of, intrinsics_of
from sim_backend import drawings

FloatArray = NDArray[np.float64]

ASSUMED = (
    "calibration.nominal.intrinsics is not given: a lens is assumed that sees 60° from left to "
    "right. Should many poses not show the board: `rig calibrate intrinsics --from-images` first"
)
_HALF_WIDTH = 0.577  # of that view, at unit distance; most lenses see 45 to 75°
GUESS_DOUBT = 0.25  # its focal length's deviation, as a share


def with_nominal(config: RigConfig) -> RigConfig:
    """The configuration with the values to start from in the place of calibrated ones.

    They are those of ``calibration.nominal``, or else those that the rig file gives as measured,
    or else, of the simulated rig, its drawings.
    """
    given, nominal = config.calibration, config.calibration.nominal
    values: dict[str, object] = {}
    if nominal.intrinsics is not None:
        values["intrinsics"] = nominal.intrinsics
    elif given.intrinsics is None and is_simulated(config):
        values["intrinsics"] = _drawn_intrinsics(config)
    if nominal.tool_camera_xyz_m is not None:
        place = nominal.tool_camera_xyz_m, nominal.tool_camera_rotvec_rad
        values |= {"tool_camera_xyz_m": place[0], "tool_camera_rotvec_rad": place[1]}
        values["tcp_offset"] = None  # they are of no tool in particular
    elif given.tool_camera_xyz_m is None and is_simulated(config):
        values["tool_camera_xyz_m"] = drawings.T_TOOL_CAMERA[:3]
        values["tool_camera_rotvec_rad"] = drawings.T_TOOL_CAMERA[3:]
    if nominal.latency_s is not None:
        values["latency_s"] = nominal.latency_s
    return replaced(config, values)


def start_intrinsics(config: RigConfig, width: int, height: int) -> Intrinsics:
    """The intrinsics of ``config``, or else those of a lens that sees 60° from left to right."""
    focal_px = 0.5 * width / _HALF_WIDTH
    guess = Intrinsics(focal_px, focal_px, 0.5 * (width - 1), 0.5 * (height - 1))
    return intrinsics_of(config) or guess


def start_place(config: RigConfig) -> FloatArray:
    """T_tool_camera (4, 4) to plan motions with; raises ConfigError that says what to type."""
    known = hand_eye_of(config)
    if known is None:
        raise ConfigError(
            "calibrating plans its motions with a rough idea (2 cm, 10°) of where the camera sits "
            "on the tool, and the rig file does not give it. Measure with a ruler and write, with "
            "your numbers:\n"
            "calibration:\n  nominal:\n"
            "    tool_camera_xyz_m: [0.0, 0.0, 0.05]         # of the camera, in tool axes\n"
            "    tool_camera_rotvec_rad: [0.0, 0.0, 0.0]     # camera axes: x right, y down, z "
            "forward\n"
            "Or bring the arm to the poses by hand, which needs no such idea: rig calibrate "
            "--manual"
        )
    return known


def start_doubt(configured: StartDoubt, guessed: bool) -> StartDoubt:
    """How far the values to start from may be off; ``guessed``: with a lens that is a guess."""
    focal = max(configured.focal, GUESS_DOUBT) if guessed else configured.focal
    return configured.model_copy(update={"focal": focal})


def replaced(config: RigConfig, values: dict[str, object]) -> RigConfig:
    """``config`` with other ``values`` in its section ``calibration``."""
    data = {**config.calibration.model_dump(), **values}
    return config.model_copy(update={"calibration": CalibrationConfig.model_validate(data)})


def _drawn_intrinsics(config: RigConfig) -> IntrinsicsConfig:
    camera = config.sim.camera
    return IntrinsicsConfig(
        fx_px=drawings.FOCAL_PX,
        fy_px=drawings.FOCAL_PX,
        cx_px=0.5 * (camera.width - 1),
        cy_px=0.5 * (camera.height - 1),
    )
