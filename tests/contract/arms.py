"""Every arm behind one face: how to open it, what it truly does, how exact it must be."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.clock import Clock, WallClock
from drivers.grbl.arm import GrblArm
from drivers.grbl.settings import GrblSettings
from drivers.interfaces import Arm
from drivers.ur.arm import UrArm
from drivers.ur.settings import UrSettings
from sim_backend import kinematics as gantry_kinematics
from sim_backend.clock import SimulatedClock
from sim_backend.config import SimConfig
from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.process import LoopbackGantryProcess
from sim_backend.loopback_ur import kinematics as ur_kinematics
from sim_backend.rig import SimulatedRig
from tests.drivers.grbl.simulated import settings_for
from tests.drivers.ur.loopback import start_loopback

FloatArray = NDArray[np.float64]

# Room that a busy host gets: the devices themselves keep time in processes of their own.
HOST_IS_BUSY_S = 0.15


@dataclass(frozen=True)
class Motion:
    """What the tool truly did: at the controller, not in the driver."""

    t_s: FloatArray  # (n,)
    T_base_tool: FloatArray  # (n, 4, 4)
    twist_tool: FloatArray  # (n, 6)


class Breakable(Protocol):
    """A device that fails when told to."""

    def fault(self, name: str) -> None: ...

    def clear(self) -> None: ...


@dataclass(frozen=True)
class Backend:
    """One arm; ``open`` makes a driver for it, one at a time."""

    open: Callable[[], Arm]
    clock: Clock
    motion: Callable[[float], Motion] | None  # since an instant; None: nobody knows the truth
    twist: FloatArray  # (6,) that it has room for, in tool axes
    period_s: float  # between states
    settle_s: float  # from a command to its full speed
    stop_s: float  # from the end of a command, or a stop, to rest
    max_age_s: float  # no newest state may be older
    twist_error: float  # relative, of the true speed to the commanded one once settled
    pose_error_m: float  # of a state against the truth at its instant
    device: Breakable | None = None


def simulated(stack: ExitStack, folder: Path) -> Backend:
    """The simulated rig on simulated time: exact, never busy."""
    clock = SimulatedClock(5.0)
    rigs: list[SimulatedRig] = []

    def open_arm() -> Arm:
        rigs.append(SimulatedRig(SimConfig(renderer="raster"), "sphere", clock))
        return rigs[-1].arm

    def motion(since_s: float) -> Motion:
        rig = rigs[-1]
        rig.truth.T_base_camera(clock.now_s())  # brings the world up to now
        history = rig._world.history
        first = max(0, int(np.ceil((since_s - history.start_s) / history.step_s)))
        numbers = np.arange(first, history.count)
        q, qd = history.entries(numbers)
        times = history.start_s + numbers * history.step_s
        return gantry_motion(np.column_stack([times, q, qd]))

    return Backend(
        open=open_arm,
        clock=clock,
        motion=motion,
        twist=np.array([0.04, -0.03, 0.02, 0.1, -0.15, 0.05]),
        period_s=0.002,
        settle_s=0.3,
        stop_s=0.25,
        max_age_s=0.02,
        twist_error=0.02,
        pose_error_m=5e-5,
    )


def loopback_ur(stack: ExitStack, folder: Path) -> Backend:
    """The vendor's package through real sockets to an emulated UR5e."""
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    process = stack.enter_context(start_loopback(unlock_after_s=0.2))
    settings = UrSettings(host=process.host, watchdog_hz=5.0, max_state_age_s=0.2)
    control = process.control
    return Backend(
        open=lambda: UrArm(settings, WallClock()),
        clock=WallClock(),
        motion=lambda since_s: ur_motion(control.motion(since_s)),
        twist=np.array([0.04, 0.0, 0.02, 0.0, 0.0, 0.1]),
        period_s=0.002,
        settle_s=0.3,
        stop_s=0.1 + HOST_IS_BUSY_S,
        max_age_s=0.02 + HOST_IS_BUSY_S,
        twist_error=0.01,
        pose_error_m=3e-4,
        device=control,
    )


def loopback_gantry(stack: ExitStack, folder: Path) -> Backend:
    """The serial driver through a pty to an emulated grblHAL."""
    machine = Machine()
    gantry = stack.enter_context(LoopbackGantryProcess(folder / "gantry"))
    settings = settings_for(machine, port=str(gantry.port), silence_s=0.6)
    control = gantry.control
    return Backend(
        open=lambda: GrblArm(settings, WallClock()),
        clock=WallClock(),
        motion=lambda since_s: gantry_motion(control.motion(since_s)),
        twist=np.array([0.04, -0.02, 0.02, 0.0, 0.0, 0.1]),
        period_s=1.0 / settings.poll_hz,
        settle_s=0.5,
        stop_s=0.15 + HOST_IS_BUSY_S,
        max_age_s=0.15 + HOST_IS_BUSY_S,
        twist_error=0.03,
        pose_error_m=3e-3,
        device=control,
    )


def ur_motion(rows: FloatArray) -> Motion:
    poses, twists = np.empty((len(rows), 4, 4)), np.empty((len(rows), 6))
    for k, row in enumerate(rows):
        poses[k], J = ur_kinematics.pose_and_jacobian(row[1:7], np.eye(4))
        R_tool_base = poses[k, :3, :3].T
        twist_base = J @ row[7:13]
        twists[k] = np.concatenate([R_tool_base @ twist_base[:3], R_tool_base @ twist_base[3:]])
    return Motion(rows[:, 0], poses, twists)


def gantry_motion(rows: FloatArray) -> Motion:
    poses, twists = np.empty((len(rows), 4, 4)), np.empty((len(rows), 6))
    for k, row in enumerate(rows):
        poses[k] = gantry_kinematics.tool_pose(row[1:7])
        twists[k] = gantry_kinematics.tool_twist(row[1:7], row[7:13])
    return Motion(rows[:, 0], poses, twists)


def real_ur(host: str) -> Backend:
    """A real arm; it moves a centimetre or so about where it stands."""
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    return Backend(
        open=lambda: UrArm(UrSettings(host=host), WallClock()),
        clock=WallClock(),
        motion=None,
        twist=np.array([0.008, 0.006, -0.005, 0.0, 0.0, 0.02]),
        period_s=0.002,
        settle_s=0.3,
        stop_s=0.25,
        max_age_s=0.05,
        twist_error=0.05,
        pose_error_m=1e-3,
    )


def real_gantry(port: str) -> Backend:
    """A real gantry, homed and clear; only its slides move, a centimetre or so."""
    settings = GrblSettings(port=port)
    return Backend(
        open=lambda: GrblArm(settings, WallClock()),
        clock=WallClock(),
        motion=None,
        twist=np.array([0.008, 0.006, -0.005, 0.0, 0.0, 0.0]),
        period_s=1.0 / settings.poll_hz,
        settle_s=0.5,
        stop_s=0.3,
        max_age_s=0.25,
        twist_error=0.1,
        pose_error_m=3e-3,
    )
