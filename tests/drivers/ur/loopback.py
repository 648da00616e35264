"""Loopback controllers for tests, each on an address of its own so that suites run side by side."""

import os
import socket
from collections.abc import Iterator

import numpy as np

from drivers.clock import WallClock
from drivers.errors import RigError
from drivers.ur.arm import UrArm
from sim_backend.loopback_ur.process import LoopbackProcess
from sim_backend.loopback_ur.server import RTDE_PORT

HOLD_S = 0.15


def addresses() -> Iterator[str]:
    """Loopback addresses that differ from process to process."""
    pid = os.getpid()
    for k in range(1, 250):
        yield f"127.{1 + (pid // 250) % 250}.{1 + pid % 250}.{k}"


def start_loopback(**options: float) -> LoopbackProcess:
    """A controller on the first free address; the caller closes it."""
    return LoopbackProcess(free_host(), lifetime_s=900.0, **options)  # type: ignore[arg-type]


def free_host() -> str:
    """A loopback address on which no controller listens."""
    return next(host for host in addresses() if _is_free(host))


def _is_free(host: str) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, RTDE_PORT))
        except OSError:
            return False
    return True


def drive(arm: UrArm, twist: np.ndarray, for_s: float) -> RigError | None:
    """Command ``twist`` at 100 Hz for a while; the error that ended it, if any."""
    clock = WallClock()
    end_s = clock.now_s() + for_s
    while clock.now_s() < end_s:
        try:
            arm.command_twist(twist, HOLD_S)
            arm.read_states()
        except RigError as error:
            return error
        clock.sleep_until(clock.now_s() + 0.01)
    return None


def last_motion_s(loopback: LoopbackProcess, since_s: float) -> float:
    """The last instant at which the true flange moved, measured at the controller."""
    speeds = loopback.control.tool_speeds(since_s)
    moving = np.abs(speeds[:, 1:]).max(axis=1) > 1e-3
    return float(speeds[moving, 0].max()) if moving.any() else since_s
