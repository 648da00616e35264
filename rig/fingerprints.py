"""What a calibration depends on, as short texts that change when it does."""

from drivers.camera.settings import CameraSettings
from drivers.grbl.settings import AxisSettings, GrblSettings
from rig.calibration.result import Fingerprints, Json, fingerprint
from rig.config import RigConfig

# What decides where a point of the world is imaged, and when. How long a camera is waited for
# and the like may change without its calibration's becoming wrong.
_OF_CAMERA = {
    "source", "width", "height", "rate_hz", "fourcc", "controls", "transfer_s",
    "assumed_exposure_s",
}  # fmt: skip
# Of an axis: its ends may change.
_OF_AXIS = {"letter", "joint", "sign", "mpos_at_zero"}


def fingerprints(config: RigConfig) -> Fingerprints:
    """What a calibration depends on, as far as the configuration tells; the rest tell devices."""
    return {
        "camera": fingerprint(_camera(config)),
        "arm": fingerprint(_arm(config)),
        "board": fingerprint(config.calibration.board.model_dump(mode="json")),
    }


def _camera(config: RigConfig) -> dict[str, Json]:
    camera = config.camera
    if isinstance(camera, CameraSettings):
        return {"driver": camera.driver, **camera.model_dump(mode="json", include=_OF_CAMERA)}
    size = (config.sim.camera.width, config.sim.camera.height)
    return {"driver": camera.driver, "size": size}


def _arm(config: RigConfig) -> dict[str, Json]:
    arm = config.arm
    if not isinstance(arm, GrblSettings):
        return {"driver": arm.driver}
    axes = None if arm.axes is None else [_axis(axis) for axis in arm.axes]
    return {"driver": arm.driver, "axes": axes, "wrist": arm.wrist.model_dump(mode="json")}


def _axis(axis: AxisSettings) -> Json:
    return axis.model_dump(mode="json", include=_OF_AXIS)
