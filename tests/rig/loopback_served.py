"""``rig sim serve`` in a process of its own, and the truth about its arm's motion."""

import os
import re
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import WallClock
from drivers.errors import RigError
from drivers.ur.recovery import recover_controller
from rig.config_load import packaged_config
from sim_backend.loopback_grbl.control import ControlClient
from sim_backend.loopback_rig.orders import order
from sim_backend.loopback_ur.process import LoopbackControl
from tests.contract.arms import Motion, gantry_motion, ur_motion
from tests.rig.command_line import RIG, rig

FloatArray = NDArray[np.float64]
ArmKind = Literal["ur", "grbl"]

# Slower than this the tool stands.
_STILL_M_S, _STILL_RAD_S = 1e-3, 4e-3
_CLOCK = WallClock()
# Small pictures: what is tested is how it ends, on machines that do other things too.
_SMALL = {"width": 320, "height": 240, "focal_px": 400.0, "rate_hz": 12.0}
_INTRINSICS = "{fx_px: 400, fy_px: 400, cx_px: 159.5, cy_px: 119.5}"


class Control(Protocol):
    """A controller's own port."""

    def motion(self, since_s: float) -> FloatArray: ...

    def close(self) -> None: ...


class Served:
    """A running emulated rig: what to pass to ``rig run``, faults, and where its tool truly is."""

    def __init__(self, arm: ArmKind, host: str, link: Path, stream: str, small: bool) -> None:
        self.arm = arm
        self._small = small
        self.host = host
        self.link = link
        self.stream = stream
        self._control: Control = LoopbackControl(host) if arm == "ur" else ControlClient(link)
        self._start_m = self._newest().T_base_tool[-1, :3, 3]

    def arguments(self) -> list[str]:
        """For ``rig run``: this rig, through its true drivers."""
        name = "loopback_ur5e.yaml" if self.arm == "ur" else "loopback_gantry.yaml"
        address = f"arm.host={self.host}" if self.arm == "ur" else f"arm.port={self.link}"
        small = ("--set", f"calibration.intrinsics={_INTRINSICS}") if self._small else ()
        return [
            *("--rig", str(packaged_config(name)), "--target", "sphere"),
            *("--set", address, "--set", f"camera.source={self.stream}", *small),
        ]

    def motion(self, since_s: float) -> Motion:
        """The tool's true motion since an instant, at the controller."""
        rows = self._control.motion(since_s)
        return ur_motion(rows) if self.arm == "ur" else gantry_motion(rows)

    def speed_m_s(self) -> float:
        """The tool's true speed now."""
        return float(np.linalg.norm(self._newest().twist_tool[-1, :3]))

    def last_motion_s(self, since_s: float) -> float:
        """The last instant at which the tool moved, ``since_s`` if it did not."""
        motion = self.motion(since_s)
        moving = moves(motion)
        return float(motion.t_s[moving].max()) if moving.any() else since_s

    def way_back(self, random: np.random.Generator) -> float:
        """+1 or −1 along the tool's x axis: towards the start if far from it, else by chance."""
        T_base_tool = self._newest().T_base_tool[-1]
        ahead_m = float(T_base_tool[:3, 0] @ (T_base_tool[:3, 3] - self._start_m))
        return float(-np.sign(ahead_m)) if abs(ahead_m) > 0.02 else float(random.choice([-1, 1]))

    def fault(self, name: str, for_s: float = 0.0) -> None:
        """What ``rig sim fault`` does."""
        order(self.host, {"fault": name, "after_s": 0.0, "for_s": for_s})

    def mend(self) -> None:
        """End all faults and bring the controller back, as a person would."""
        order(self.host, {"do": "clear"})
        if self.arm == "ur":
            self._mend_ur()
        else:
            done = rig("arm", "recover", "--arm", "grbl", "--port", str(self.link), "--yes")
            assert done.exit_code == 0, done.stderr

    def _mend_ur(self) -> None:
        give_up_s = _CLOCK.now_s() + 20.0
        while True:
            try:
                recover_controller(self.host, _CLOCK, lambda explanation: True)
                return
            except RigError:
                if _CLOCK.now_s() > give_up_s:
                    raise
            _CLOCK.sleep_until(_CLOCK.now_s() + 0.3)
            order(self.host, {"do": "clear"})

    def _newest(self) -> Motion:
        motion = self.motion(_CLOCK.now_s() - 0.05)
        while not len(motion.t_s):
            motion = self.motion(_CLOCK.now_s() - 0.5)
        return motion


def moves(motion: Motion) -> NDArray[np.bool_]:
    """Whether the tool moves, at each of the instants (n,)."""
    linear = np.linalg.norm(motion.twist_tool[:, :3], axis=1) > _STILL_M_S
    angular = np.linalg.norm(motion.twist_tool[:, 3:], axis=1) > _STILL_RAD_S
    return np.asarray(linear | angular)


@contextmanager
def served(
    arm: ArmKind,
    folder: Path,
    small: bool = True,
    for_s: float = 1800.0,
    target: Literal["sphere", "board"] = "sphere",
) -> Iterator[Served]:
    """``rig sim serve`` with its camera until the block ends; ``small``: cheap pictures."""
    host, link = free_host(), folder / "gantry"
    process = subprocess.Popen(
        [
            *(*RIG, "sim", "serve", "--arm", arm, "--host", host, "--link", str(link)),
            *("--camera", "--port", "0", "--for", str(for_s), "--set", "sim.renderer=raster"),
            *("--target", target),
            *(part for key, value in _SMALL.items() if small for part in _camera(key, value)),
        ],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    try:
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.search(r"http://\S+?\.mjpg", line)
        assert found, line
        yield Served(arm, host, link, found.group(0), small)
    finally:
        process.terminate()
        try:
            process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _camera(key: str, value: float) -> tuple[str, str]:
    return "--set", f"sim.camera.{key}={value}"


def free_host() -> str:
    """A loopback address where nobody listens on the controller's or the orders' ports."""
    for last in range(2, 250):
        host = f"127.{40 + os.getpid() % 200}.{1 + os.getpid() // 200 % 250}.{last}"
        if all(_is_free(host, port) for port in (30004, 29989)):
            return host
    raise AssertionError("no free loopback address")


def _is_free(host: str, port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex((host, port)) != 0
