"""A servo's task for the camera at hand, and how well it was done."""

import numpy as np

from drivers.errors import ConfigError
from estimator.active.servo_task import ServoTask
from estimator.image.intrinsics import Intrinsics
from rig.config import RigConfig
from rig.field_of_view import border_planes, room_in_view
from rig.records import Json
from rig.run_data import RunData

# A camera without lens or image, for what has to be tried before there is one.
NO_LENS = Intrinsics(1.0, 1.0, 0.0, 0.0)


def servo_task(config: RigConfig, intrinsics: Intrinsics) -> ServoTask | None:
    """What `motion.servo` asks of a camera; None without a servo.

    Raises ConfigError for a place outside the image, or so near its border or so close to the
    camera that not even the smallest target to be expected would be seen whole.
    """
    if config.motion.policy != "servo":
        return None
    servo = config.motion.servo
    xy = np.zeros(2)
    if servo.position_px is not None and intrinsics is not NO_LENS:
        xy = intrinsics.normalise(np.array(servo.position_px))
    bearing = np.append(xy, 1.0) / np.linalg.norm(np.append(xy, 1.0))
    size = _image_size(config)
    if size is not None and intrinsics is not NO_LENS:
        _check_in_view(config, intrinsics, bearing, size)
    return ServoTask(
        bearing, servo.distance_m, intrinsics.fx_px, servo.tolerance_px, servo.tolerance_m
    )


def servo_figures(data: RunData, config: RigConfig, intrinsics: Intrinsics) -> dict[str, Json]:
    """How far the last image shows the target from its wanted place; None without a servo."""
    task = servo_task(config, intrinsics)
    off_px = off_m = None
    if task is not None and data.updates:
        last = data.updates[-1]
        off_px, off_m = task.off_px(last), task.off_m(last)
    known = off_px is not None and np.isfinite(off_px)
    return {"servo_error_px": off_px if known else None, "servo_distance_error_m": off_m}


def _image_size(config: RigConfig) -> tuple[int, int] | None:
    """Width and height of the images, where they are known beforehand."""
    if config.camera.driver == "sim":
        return config.sim.camera.width, config.sim.camera.height
    width, height = config.camera.width, config.camera.height
    return None if width is None or height is None else (width, height)


def _check_in_view(
    config: RigConfig, intrinsics: Intrinsics, bearing: np.ndarray, size: tuple[int, int]
) -> None:
    servo, margin_px = config.motion.servo, config.safety.field_of_view_margin_px
    width, height = size
    planes = border_planes(intrinsics, (height, width), margin_px)
    image = f"the image of {width} x {height} less safety.field_of_view_margin_px = {margin_px:g}"
    if (planes @ bearing).min() <= 0.0:
        where = "the principal point" if servo.position_px is None else list(servo.position_px)
        raise ConfigError(f"motion.servo.position_px: {where} is outside {image}")
    least_m = config.estimator.radius_range[0]
    s = bearing * (1.0 + servo.distance_m / least_m)
    if room_in_view(s, None, planes).min() <= 0.0:
        raise ConfigError(
            f"motion.servo: at distance_m = {servo.distance_m:g} from position_px even a target "
            f"of the least radius expected, {1e3 * least_m:g} mm, reaches out of {image}"
        )
