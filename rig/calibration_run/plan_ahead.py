"""Which poses a calibration would look from, worked out on the simulated rig: nothing is opened."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.errors import ConfigError
from drivers.interfaces import ArmState
from rig.build import is_simulated
from rig.calibration import se3
from rig.calibration.board import corner_points
from rig.calibration.board_pose import board_pose
from rig.calibration.hand_eye_model import State
from rig.calibration.pose_candidates import Scene
from rig.calibration.pose_planning import PlannedPose, plan_poses, tour
from rig.calibration.projection import to_vector
from rig.calibration_run.collector import FIRST, REFINED, within_safety
from rig.calibration_run.joints_ahead import joints_ahead
from rig.calibration_run.reach import Reach
from rig.calibration_run.routes import Routes
from rig.calibration_run.store import Store
from rig.config import RigConfig
from rig.given_values import intrinsics_of
from rig.start_values import start_doubt, start_intrinsics, start_place
from sim_backend.lens import lens_of
from sim_backend.scene import build_scene
from sim_backend.start import start_pose

FloatArray = NDArray[np.float64]

_DEFAULT_SIZE = (640, 480)


@dataclass(frozen=True, slots=True)
class Foresight:
    """What would happen, as far as it can be told."""

    scene: Scene
    first: tuple[PlannedPose, ...]  # in the order of the tour
    later: tuple[PlannedPose, ...]  # planned anew on the way, when more is known
    assumed: str  # where the first look is taken from, in words
    joints_checked: bool
    joints_of: str  # the arm whose joints were checked, or why none were


def plan_ahead(config: RigConfig, store_folder: Path, conditions: dict[str, str]) -> Foresight:
    """Plan as ``rig calibrate`` would; raises ConfigError and CalibrationError as it does."""
    plan, size = config.calibration.plan, image_size(config)
    T_tool_camera, intrinsics = start_place(config), start_intrinsics(config, *size)
    T_base_tool, T_camera_board, assumed = _first_look(
        config, T_tool_camera, store_folder, conditions
    )
    board = T_base_tool @ T_tool_camera @ T_camera_board
    state = State(T_tool_camera, board, to_vector(intrinsics))
    scene = Scene(state, corner_points(config.calibration.board), size, T_base_tool)
    limits = within_safety(plan.limits, config.safety)
    doubt = start_doubt(plan.doubt, intrinsics_of(config) is None)
    joints, whose = joints_ahead(config, T_base_tool)
    here = ArmState(0.0, T_base_tool, np.zeros(6))
    reach = Routes(Reach(config.safety, here, joints, T_tool_camera), [T_base_tool])
    first = plan_poses(scene, min(FIRST, plan.poses) - 1, limits, doubt, [T_base_tool], reach)
    taken = [T_base_tool, *(pose.T_base_tool for pose in first)]
    count = plan.poses - len(taken)
    later = plan_poses(scene, count, limits, REFINED, taken, reach) if count > 0 else []
    there = tour(first, T_base_tool)
    return Foresight(
        scene,
        tuple(there),
        tuple(tour(later, there[-1].T_base_tool)),
        assumed,
        joints is not None,
        whose,
    )


def image_size(config: RigConfig) -> tuple[int, int]:
    """Width and height as configured, or what most cameras start with."""
    camera = config.camera
    if camera.driver == "sim":
        return config.sim.camera.width, config.sim.camera.height
    if camera.width is None or camera.height is None:
        return _DEFAULT_SIZE
    return camera.width, camera.height


def _first_look(
    config: RigConfig, T_tool_camera: FloatArray, folder: Path, conditions: dict[str, str]
) -> tuple[FloatArray, FloatArray, str]:
    """T_base_tool, T_camera_board (4, 4) of the first look and where they are from."""
    if not is_simulated(config) and folder.is_dir():
        try:
            stills = Store(folder, conditions, resume=True).stills
        except ConfigError:
            stills = []  # of another rig, or none: the simulated scene is as good
        if stills:
            view = stills[0].view
            seen = board_pose(view.board, start_intrinsics(config, *image_size(config)))
            return view.T_base_tool, seen, f"as last time (the first still in {folder})"
    scene, start = build_scene(config.sim, "board"), config.sim.board.start
    camera = start_pose(scene.target, start, lens_of(config.sim.camera))
    board = getattr(scene.target, "T_base_board")  # noqa: B009 - a board, whatever its union says
    return (
        camera @ se3.inverse(T_tool_camera),
        se3.inverse(camera) @ board,
        f"as the simulated rig has it: the board at {list(config.sim.board.position_m)} m in "
        f"base, seen from {100 * start.distance_m:.0f} cm (sim.board)",
    )
