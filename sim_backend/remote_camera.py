"""A simulated camera on an arm that another process moves."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.interfaces import Camera
from sim_backend.camera import SimulatedCamera
from sim_backend.config import SimConfig
from sim_backend.exposure import Exposure
from sim_backend.lens import lens_of
from sim_backend.loopback_rig.remote import MotionSource, RemoteMotion
from sim_backend.render_choice import choose_renderer, make_renderer
from sim_backend.rig import mount
from sim_backend.scene import SceneKind, build_scene, middle_m
from sim_backend.stamps import stamped

FloatArray = NDArray[np.float64]


def remote_camera(
    config: SimConfig,
    target: SceneKind,
    source: MotionSource,
    tool_pose: Callable[[FloatArray], FloatArray],
    clock: Clock,
) -> Camera:
    """The camera of ``config`` on a tool at ``tool_pose`` (4, 4) of the joints that move.

    Raises ConnectError where the renderer asked for cannot be had.
    """
    lens, scene = lens_of(config.camera), build_scene(config, target)
    renderer = make_renderer(choose_renderer(config.renderer, target), scene, lens)
    motion = RemoteMotion(source, tool_pose, mount(config), clock)
    exposure = Exposure(config.camera, lens, motion, middle_m(scene.target))
    camera = SimulatedCamera(config.camera, lens, motion, exposure, renderer, config.seed)
    return stamped(camera, config.camera)
