"""Assembles an emulated rig: the controller's process, its camera's stream, faults for both."""

import ipaddress
import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Literal, Protocol, Self, cast, get_args

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import ConfigError, ConnectError
from sim_backend import kinematics as gantry_kinematics
from sim_backend.camera import SimulatedCamera
from sim_backend.config import SimConfig
from sim_backend.exposure import Exposure
from sim_backend.lens import lens_of
from sim_backend.loopback_camera.server import Fault, MjpegServer
from sim_backend.loopback_grbl.control import ControlClient
from sim_backend.loopback_grbl.process import LoopbackGantryProcess
from sim_backend.loopback_rig.orders import OrderServer
from sim_backend.loopback_rig.remote import MotionSource, RemoteMotion
from sim_backend.loopback_ur import kinematics as ur_kinematics
from sim_backend.loopback_ur.config import version_of
from sim_backend.loopback_ur.process import LoopbackControl, LoopbackProcess
from sim_backend.render_choice import choose_renderer, make_renderer
from sim_backend.rig import mount
from sim_backend.scene import SceneKind, build_scene, middle_m
from sim_backend.start import start_pose

FloatArray = NDArray[np.float64]
ArmKind = Literal["ur", "grbl"]


class Control(Protocol):
    """What the emulated controllers offer from outside their process."""

    def fault(self, name: str, after_s: float = 0.0, for_s: float = 0.0) -> None: ...

    def clear(self) -> None: ...


@dataclass(frozen=True, slots=True)
class _Emulated:
    """A running controller and how its joints place the tool."""

    control: Control
    motion: MotionSource  # a connection of the camera's own
    tool_pose: Callable[[FloatArray], FloatArray]


class LoopbackRig:
    """An emulated arm and, if asked for, the camera on its tool, until closed.

    ``arm`` is "ur" (a UR5e on the controller's own ports of ``host``) or "grbl" (a gantry on a
    pseudo-terminal at ``link``); ``ur_version`` is the UR controller's software, of which 3.… is
    a CB3. Raises ConfigError for a start the arm cannot reach or a version that is none,
    ConnectError for ports already taken.
    """

    def __init__(
        self,
        arm: ArmKind,
        config: SimConfig,
        target: SceneKind,
        clock: Clock,
        host: str,
        link: Path,
        camera_port: int | None,
        lifetime_s: float,
        ur_version: str | None = None,
    ) -> None:
        _check_loopback(host)
        _check_version(ur_version)
        self._ur_version = ur_version
        self._stack = ExitStack()
        self.stream: MjpegServer | None = None
        try:
            emulated = self._start(arm, _start_pose(config, target), host, link, lifetime_s)
            self._control = emulated.control
            if camera_port is not None:
                self._serve_camera(config, target, clock, emulated, host, camera_port)
            orders = OrderServer(host, self)
            self._stack.callback(orders.close)
        except OSError as error:
            self.close()
            raise ConnectError(
                f"the emulated rig cannot start on {host}: {error}; is another one running?"
            ) from error
        except ValueError as error:
            self.close()
            raise ConfigError(f"the arm cannot reach sim.{target}.start: {error}") from error
        except BaseException:
            self.close()
            raise

    def _start(
        self, arm: ArmKind, T_base_tool: FloatArray, host: str, link: Path, lifetime_s: float
    ) -> _Emulated:
        if arm == "ur":
            T_flange_tool = np.eye(4)
            q = ur_kinematics.joints_for(T_base_tool, ur_kinematics.HOME_Q, T_flange_tool)
            ur = self._stack.enter_context(
                LoopbackProcess(
                    host, lifetime_s, q_start=tuple(q.tolist()), version=self._ur_version
                )
            )
            pose = partial(ur_kinematics.tool_pose, T_flange_tool=T_flange_tool)
            source = LoopbackControl(host)
            self._stack.callback(source.close)
            return _Emulated(ur.control, source, pose)
        q = gantry_kinematics.joints_for(T_base_tool)
        start = "--q-start=" + ",".join(repr(float(value)) for value in q)
        gantry = self._stack.enter_context(
            LoopbackGantryProcess(link, (start, f"--lifetime-s={lifetime_s}"))
        )
        client = ControlClient(link)
        self._stack.callback(client.close)
        return _Emulated(gantry.control, client, gantry_kinematics.tool_pose)

    def _serve_camera(
        self,
        config: SimConfig,
        target: SceneKind,
        clock: Clock,
        emulated: _Emulated,
        host: str,
        port: int,
    ) -> None:
        lens, scene = lens_of(config.camera), build_scene(config, target)
        renderer = make_renderer(choose_renderer(config.renderer, target), scene, lens)
        motion = RemoteMotion(emulated.motion, emulated.tool_pose, mount(config), clock)
        exposure = Exposure(config.camera, lens, motion, middle_m(scene.target))
        camera = SimulatedCamera(config.camera, lens, motion, exposure, renderer, config.seed)
        self._stack.callback(camera.close)
        self.stream = self._stack.enter_context(MjpegServer(camera.read, host, port))

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


def _start_pose(config: SimConfig, target: SceneKind) -> FloatArray:
    """T_base_tool (4, 4) from which the camera sees the target as configured."""
    lens, scene = lens_of(config.camera), build_scene(config, target)
    T_base_camera = start_pose(scene.target, getattr(config, target).start, lens)
    T_base_tool: FloatArray = T_base_camera @ np.linalg.inv(mount(config))
    return T_base_tool


def _check_loopback(host: str) -> None:
    try:
        local = ipaddress.ip_address(host).is_loopback
    except ValueError:
        local = False
    if not local:
        raise ConfigError(
            f"--host {host}: an emulated rig listens on loopback addresses only (127.0.0.1, …)"
        )


def _check_version(ur_version: str | None) -> None:
    if ur_version is not None:
        try:
            version_of(ur_version)
        except ValueError as error:
            raise ConfigError(str(error)) from error


def _later(delay_s: float, action: Callable[[], None]) -> None:
    timer = threading.Timer(max(delay_s, 0.0), action)
    timer.daemon = True
    timer.start()
