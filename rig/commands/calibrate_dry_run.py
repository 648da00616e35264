"""``rig calibrate --dry-run``: the planned poses in words and as a picture."""

import json
from typing import TYPE_CHECKING

import numpy as np

from rig.commands.calibrate_request import Request, Step, earlier, with_earlier
from rig.commands.options import warn

if TYPE_CHECKING:
    from rig.calibration_run.plan_ahead import Foresight


def dry_run(step: Step, request: Request) -> None:
    """Plan and draw; opens nothing."""
    from rig.calibration_place import calibration_path
    from rig.calibration_run.plan_ahead import plan_ahead
    from rig.calibration_run.plan_picture import draw_plan
    from rig.fingerprints import fingerprints
    from rig.start_values import with_nominal

    config = request.config()
    path, now = calibration_path(config, request.rig), fingerprints(config)
    config = with_nominal(with_earlier(config, step, earlier(step, path, now)))
    foresight = plan_ahead(config, path.with_name(f"{config.name}-data"), now)
    picture = path.with_name(f"{config.name}-plan.png")
    title = f"planned calibration of {config.name}: nothing has moved"
    draw_plan(picture, title, foresight, config.calibration.board, config.safety)
    low, high = config.safety.workspace_min_m, config.safety.workspace_max_m
    warn(f"first look: {foresight.assumed}")
    for number, pose in enumerate((*foresight.first, *foresight.later), start=2):
        x, y, z = (f"{value:6.3f}" for value in pose.T_base_tool[:3, 3])
        warn(
            f"{number:4d}  tool at {x} {y} {z} m, {100 * pose.distance_m:.0f} cm from the board, "
            f"tilted {np.degrees(pose.tilt_rad):.0f}°, {pose.corners} corners, adds "
            f"{pose.gain:.1f} bit"
        )
    tools = _positions(foresight)
    warn(
        f"the tool stays within x {_span(tools[:, 0])}, y {_span(tools[:, 1])}, z "
        f"{_span(tools[:, 2])} m of the workspace {list(low)} … {list(high)}, up to "
        f"{np.linalg.norm(tools, axis=1).max():.2f} m from the base's origin"
    )
    warn(
        "every pose, on the way from the first look, is within the joints' ranges and off the "
        f"singularities of {foresight.joints_of}"
        if foresight.joints_checked
        else foresight.joints_of
    )
    warn(f"written: {picture}")
    if request.as_json:
        print(json.dumps(_json_of(foresight, str(picture))), flush=True)


def _positions(foresight: "Foresight") -> "np.ndarray[tuple[int, ...], np.dtype[np.float64]]":
    poses = [foresight.scene.T_base_tool]
    poses += [pose.T_base_tool for pose in (*foresight.first, *foresight.later)]
    return np.array(poses)[:, :3, 3]


def _span(values: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]") -> str:
    return f"{values.min():.3f} to {values.max():.3f}"


def _json_of(foresight: "Foresight", picture: str) -> dict[str, object]:
    poses = (*foresight.first, *foresight.later)
    return {
        "poses": [
            {
                "T_base_tool": pose.T_base_tool.tolist(),
                "gain_bit": pose.gain,
                "corners": pose.corners,
                "tilt_rad": pose.tilt_rad,
                "distance_m": pose.distance_m,
            }
            for pose in poses
        ],
        "file": picture,
    }
