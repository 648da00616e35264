"""What a replay can answer "what if" about, and the geometry that goes with it."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivers.errors import ConfigError
from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig
from rig.given_values import hand_eye_of, intrinsics_of
from rig.replay.recording import Recording

FloatArray = NDArray[np.float64]
Source = Literal["features", "images"]

_ALWAYS = (
    "estimator",
    "calibration.latency_s",
    "calibration.row_time_s",
    "calibration.tool_camera_xyz_m",
    "calibration.tool_camera_rotvec_rad",
    "run.converged_fraction",
    "run.until_share",
)
_FROM_IMAGES = ("camera.method", "calibration.intrinsics")


def check_answerable(assignments: list[str], source: Source) -> None:
    """Raises ConfigError for a setting whose effect a replay cannot show."""
    for assignment in assignments:
        key = assignment.partition("=")[0].strip()
        if _below(key, _ALWAYS):
            continue
        if not _below(key, _FROM_IMAGES):
            raise ConfigError(
                f"--set {key}: a replay repeats the recorded motion and images, so this changes "
                f"nothing; it can change {', '.join((*_ALWAYS, *_FROM_IMAGES))}"
            )
        if source != "images":
            raise ConfigError(
                f"--set {key}: the images have to be measured anew, add --from images"
            )


def geometry_of(recording: Recording, config: RigConfig) -> tuple[Intrinsics, FloatArray]:
    """Intrinsics and hand-eye: the recorded ones, to the bit, unless the settings changed them."""
    before, now = recording.config().calibration, config.calibration
    intrinsics, T_tool_camera = recording.intrinsics, recording.T_tool_camera
    if now.intrinsics != before.intrinsics:
        intrinsics = intrinsics_of(config) or intrinsics
    hand_eye = (now.tool_camera_xyz_m, now.tool_camera_rotvec_rad)
    if hand_eye != (before.tool_camera_xyz_m, before.tool_camera_rotvec_rad):
        given = hand_eye_of(config)
        T_tool_camera = T_tool_camera if given is None else given
    return intrinsics, T_tool_camera


def _below(key: str, sections: tuple[str, ...]) -> bool:
    return any(key == section or key.startswith(section + ".") for section in sections)
