"""Assembles the simulated rig: one world, seen by its camera and moved by its arm."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drivers.clock import Clock
from drivers.errors import ConfigError
from drivers.interfaces import Camera
from sim_backend.arm import SimulatedArm
from sim_backend.blank_camera import BlankCamera
from sim_backend.camera import SimulatedCamera
from sim_backend.config import SimConfig
from sim_backend.exposure import Exposure
from sim_backend.features import FeatureSource
from sim_backend.kinematics import JOINT_HIGH, JOINT_LOW, joints_for
from sim_backend.lens import Lens, lens_of
from sim_backend.motion import CameraMotion
from sim_backend.render_choice import choose_renderer, make_renderer
from sim_backend.scene import SceneKind, build_scene, middle_m
from sim_backend.shared_motion import MotionFeed
from sim_backend.stamps import stamped
from sim_backend.start import start_pose
from sim_backend.truth import Truth
from sim_backend.world import World

FloatArray = NDArray[np.float64]


class SimulatedRig:
    """A camera on a gantry in front of one target.

    ``T_tool_camera`` (4, 4) and ``intrinsics`` (fx, fy, cx, cy in px, distortion (5,)) are the
    calibration a real rig would have been given; ``truth`` is for tests and reports only.
    ``features`` is what its images show where ``config.level`` does without them. With
    ``camera_elsewhere`` the camera is simulated in another process, which follows ``feed``.

    Raises ConfigError where the start cannot be reached, ConnectError where the renderer asked
    for cannot be had.
    """

    def __init__(
        self, config: SimConfig, target: SceneKind, clock: Clock, camera_elsewhere: bool = False
    ) -> None:
        try:
            lens = lens_of(config.camera)
            lens.ray_table()
        except ValueError as error:
            raise ConfigError(str(error)) from error
        scene = build_scene(config, target)
        self.features: FeatureSource | None = None
        blind = config.level == "features"
        if blind and target == "board":
            raise ConfigError(
                "sim.level = features knows no board: leave it at pixels to calibrate"
            )
        chosen = None if blind else choose_renderer(config.renderer, target)
        self.renderer_name = "none" if chosen is None else chosen
        self.T_tool_camera = mount(config)
        start = getattr(config, target).start
        T_base_tool = start_pose(scene.target, start, lens) @ np.linalg.inv(self.T_tool_camera)
        q_start = joints_for(T_base_tool)
        _check_reachable(q_start, target)
        # First what takes long: on the wall clock the world starts to move with its creation.
        renderer = None
        if chosen is not None and not camera_elsewhere:
            renderer = make_renderer(chosen, scene, lens)
        self._world = World(config.arm, q_start, clock)
        motion = CameraMotion(self._world, self.T_tool_camera)
        self.arm = SimulatedArm(config.arm, self._world, config.seed)
        self._camera: Camera | None = None
        if renderer is not None:
            exposure = Exposure(config.camera, lens, motion, middle_m(scene.target))
            camera = SimulatedCamera(
                config.camera, lens, self._world, exposure, renderer, config.seed
            )
            self._camera = stamped(camera, config.camera)
        self.truth = Truth(scene.target, self._world, motion)
        if blind:
            blank = BlankCamera(config.camera, clock, config.seed)
            self._camera = stamped(blank, config.camera)
            self.features = FeatureSource(config.features, self.truth, lens, config.seed)
        self.intrinsics = _plain(lens)

    @property
    def camera(self) -> Camera:
        """The camera on the tool, where it is not simulated elsewhere."""
        assert self._camera is not None, "the camera is simulated in another process"
        return self._camera

    def skip_rest(self) -> None:
        """Forget a standstill that lasted until everything else was ready."""
        self._world.skip_rest()

    def feed(self) -> MotionFeed:
        """The arm's true motion, for a camera that is simulated elsewhere."""
        return MotionFeed(self._world)

    def close(self) -> None:
        """Stop the arm and release the camera; harmless when repeated."""
        self.arm.close()
        if self._camera is not None:
            self._camera.close()


def mount(config: SimConfig) -> FloatArray:
    """T_tool_camera (4, 4) as the camera is bolted on."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(config.T_tool_camera[3:]).as_matrix()
    T[:3, 3] = config.T_tool_camera[:3]
    return T


def _plain(lens: Lens) -> tuple[float, float, float, float, FloatArray]:
    return lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.distortion.copy()


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
