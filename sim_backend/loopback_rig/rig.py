"""Assembles an emulated rig: the controller's process, its camera's stream, faults for both."""

import ipaddress
import threading
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from types import TracebackType
from typing import Protocol, Self, cast, get_args

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import ConfigError, ConnectError
from sim_backend.camera import SimulatedCamera
from sim_backend.config import SimConfig
from sim_backend.exposure import Exposure
from sim_backend.lens import lens_of
from sim_backend.loopback_camera.server import Fault, MjpegServer
from sim_backend.loopback_rig.orders import OrderServer
from sim_backend.loopback_rig.remote import MotionSource, RemoteMotion
from sim_backend.loopback_ur.kinematics import HOME_Q, joints_for, tool_pose
from sim_backend.loopback_ur.process import LoopbackProcess
from sim_backend.render_choice import choose_renderer, make_renderer
from sim_backend.rig import mount
from sim_backend.scene import Sphere, TargetKind, build_scene
from sim_backend.start import start_pose

FloatArray = NDArray[np.float64]
CAMERA_PORT = 8088


class Control(MotionSource, Protocol):
    """What the emulated controllers offer from outside their process."""

    def fault(self, name: str, after_s: float = 0.0, for_s: float = 0.0) -> None: ...

    def clear(self) -> None: ...


class LoopbackRig:
    """A UR5e and, if asked for, the camera on its tool, until closed.

    Raises ConfigError for a start the arm cannot reach, ConnectError for ports already taken.
    """

    def __init__(
        self,
        config: SimConfig,
        target: TargetKind,
        clock: Clock,
        host: str,
        camera_port: int | None,
        lifetime_s: float,
    ) -> None:
        _check_loopback(host)
        self._stack = ExitStack()
        try:
            self._open(config, target, clock, host, camera_port, lifetime_s)
        except OSError as error:
            self.close()
            raise ConnectError(
                f"the emulated rig cannot start on {host}: {error}; is another one running?"
            ) from error
        except BaseException:
            self.close()
            raise

    def _open(
        self,
        config: SimConfig,
        target: TargetKind,
        clock: Clock,
        host: str,
        camera_port: int | None,
        lifetime_s: float,
    ) -> None:
        lens, scene = lens_of(config.camera), build_scene(config, target)
        T_tool_camera = mount(config)
        view = getattr(config, target).start
        T_base_tool = start_pose(scene.target, view, lens) @ np.linalg.inv(T_tool_camera)
        try:
            q_start = joints_for(T_base_tool, HOME_Q, np.eye(4))
        except ValueError as error:
            raise ConfigError(f"the arm cannot reach sim.{target}.start: {error}") from error
        process = self._stack.enter_context(
            LoopbackProcess(host, lifetime_s, q_start=tuple(q_start.tolist()))
        )
        self._control: Control = process.control
        self.stream: MjpegServer | None = None
        if camera_port is not None:
            pose = partial(tool_pose, T_flange_tool=np.eye(4))
            motion = RemoteMotion(process.control, pose, T_tool_camera, clock)
            seen = scene.target
            centre_m = seen.centre_m if isinstance(seen, Sphere) else seen.middle_m
            renderer = make_renderer(choose_renderer(config.renderer), scene, lens)
            exposure = Exposure(config.camera, lens, motion, centre_m)
            camera = SimulatedCamera(config.camera, lens, motion, exposure, renderer, config.seed)
            self._stack.callback(camera.close)
            self.stream = self._stack.enter_context(MjpegServer(camera.read, host, camera_port))
        orders = OrderServer(host, self)
        self._stack.callback(orders.close)

    def fault(self, name: str, after_s: float, for_s: float) -> None:
        """Order a fault of the camera or of the arm; raises ValueError for an unknown one."""
        if name not in get_args(Fault):
            self._control.fault(name, after_s, for_s)
            return
        stream = self.stream
        if stream is None:
            raise ValueError("this emulated rig has no camera: serve it with --camera")
        _later(after_s, partial(stream.inject, cast(Fault, name)))
        if for_s > 0.0:
            _later(after_s + for_s, stream.clear)

    def clear(self) -> None:
        """End all faults."""
        self._control.clear()
        if self.stream is not None:
            self.stream.clear()

    def close(self) -> None:
        """End everything; harmless when repeated."""
        self._stack.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def _check_loopback(host: str) -> None:
    try:
        local = ipaddress.ip_address(host).is_loopback
    except ValueError:
        local = False
    if not local:
        raise ConfigError(
            f"--host {host}: an emulated rig listens on loopback addresses only (127.0.0.1, …)"
        )


def _later(delay_s: float, action: Callable[[], None]) -> None:
    timer = threading.Timer(max(delay_s, 0.0), action)
    timer.daemon = True
    timer.start()
