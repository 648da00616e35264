"""Assembles the simulated rig: one world, seen by its camera and moved by its arm."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drivers.clock import Clock
from drivers.errors import ConfigError
from sim_backend.arm import SimulatedArm
from sim_backend.camera import SimulatedCamera
from sim_backend.config import SimConfig
from sim_backend.exposure import Exposure
from sim_backend.kinematics import JOINT_HIGH, JOINT_LOW, joints_for
from sim_backend.lens import Lens, lens_of
from sim_backend.motion import CameraMotion
from sim_backend.render_choice import choose_renderer, make_renderer
from sim_backend.scene import Sphere, TargetKind, build_scene
from sim_backend.start import start_pose
from sim_backend.truth import Truth
from sim_backend.world import World

FloatArray = NDArray[np.float64]


class SimulatedRig:
    """A camera on a gantry in front of one target.

    ``T_tool_camera`` (4, 4) and ``intrinsics`` (fx, fy, cx, cy in px, distortion (5,)) are the
    calibration a real rig would have been given; ``truth`` is for tests and reports only.

    Raises ConfigError where the start cannot be reached, ConnectError where the renderer asked
    for cannot be had.
    """

    def __init__(self, config: SimConfig, target: TargetKind, clock: Clock) -> None:
        try:
            lens = lens_of(config.camera)
            lens.ray_table()
        except ValueError as error:
            raise ConfigError(str(error)) from error
        scene = build_scene(config, target)
        self.renderer_name = choose_renderer(config.renderer)
        self.T_tool_camera = mount(config)
        start = getattr(config, target).start
        T_base_tool = start_pose(scene.target, start, lens) @ np.linalg.inv(self.T_tool_camera)
        q_start = joints_for(T_base_tool)
        _check_reachable(q_start, target)
        # First what takes long: on the wall clock the world starts to move with its creation.
        renderer = make_renderer(self.renderer_name, scene, lens)
        self._world = World(config.arm, q_start, clock)
        motion = CameraMotion(self._world, self.T_tool_camera)
        seen = scene.target
        centre_m = seen.centre_m if isinstance(seen, Sphere) else seen.middle_m
        self.arm = SimulatedArm(config.arm, self._world, config.seed)
        self.camera = SimulatedCamera(
            config.camera,
            lens,
            self._world,
            Exposure(config.camera, lens, motion, centre_m),
            renderer,
            config.seed,
        )
        self.truth = Truth(scene.target, self._world, motion)
        self.intrinsics = _plain(lens)

    def close(self) -> None:
        """Stop the arm and release the camera; harmless when repeated."""
        self.arm.close()
        self.camera.close()


def mount(config: SimConfig) -> FloatArray:
    """T_tool_camera (4, 4) as the camera is bolted on."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(config.camera.mount_rotvec_rad).as_matrix()
    T[:3, 3] = config.camera.mount_xyz_m
    return T


def _plain(lens: Lens) -> tuple[float, float, float, float, FloatArray]:
    return lens.focal_px, lens.focal_px, lens.cx_px, lens.cy_px, lens.distortion.copy()


def _check_reachable(q: FloatArray, target: str) -> None:
    names = ("x", "y", "z", "roll", "pitch", "spin")
    out = [
        f"{name} = {value:.3g} not in [{low:.3g}, {high:.3g}]"
        for name, value, low, high in zip(names, q, JOINT_LOW, JOINT_HIGH, strict=True)
        if not low <= value <= high
    ]
    if out:
        raise ConfigError(
            f"{target}.start is out of the gantry's reach ({'; '.join(out)}); "
            f"change {target}.start or {target}.position_m"
        )
