"""The vendor's control interface behind five calls; lives in the child process only.

Its quirks, each measured with ``ur_rtde`` 1.6.5: the process may die of SIGSEGV when the
connection closes; ``speedL`` reports success on a dead connection; the controller goes on
moving after the client is gone unless the watchdog was set; the watchdog dies with the
program, so it is set again after every upload (each ``Motor`` uploads once, at its start).
"""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.errors import ConnectError, OperateError
from drivers.ur.commander import Speed

FloatArray = NDArray[np.float64]

_INSTALL = "pip install 'ur-rtde>=1.6.1'"


class Motor:
    """A running control program on the controller, its watchdog armed."""

    def __init__(self, host: str, cycle_s: float, watchdog_hz: float) -> None:
        """Upload and start the control program.

        ``cycle_s`` is the controller's cycle: the uploaded script looks for a new target after
        each ``time`` it was given, so one cycle is what makes commands act at once.
        Raises ConnectError.
        """
        self._host = host
        self._cycle_s = cycle_s
        try:
            vendor = import_module("rtde_control")
        except ImportError as error:
            raise ConnectError(f"UR arms need the package ur-rtde: {_INSTALL}") from error
        try:
            self._control: Any = vendor.RTDEControlInterface(host)
            armed = self._control.isProgramRunning() and self._control.setWatchdog(watchdog_hz)
        except (RuntimeError, ValueError, OSError) as error:
            raise ConnectError(
                f"the arm at {host} does not take the control program: {error}"
            ) from error
        if not armed:
            raise ConnectError(
                f"the arm at {host} does not run the control program: check on the pendant that "
                "it is switched on, its brakes released and in remote control"
            )

    def tcp_offset(self) -> tuple[float, ...]:
        """(x, y, z, rx, ry, rz) of the tool centre point in the flange's frame, m and rad."""
        try:
            return tuple(float(x) for x in self._control.getTCPOffset())
        except RuntimeError as error:
            raise ConnectError(f"the arm at {self._host} does not tell its TCP: {error}") from error

    def send(self, speed: Speed | None) -> None:
        """One ``speedL``, or with None just the watchdog's food.

        Raises OperateError when the vendor's interface knows that the connection is gone.
        """
        if not self._control.isConnected():
            raise OperateError(f"the connection to the arm at {self._host} is gone")
        if speed is None:
            self._control.kickWatchdog()
        else:
            self._control.speedL(speed.twist_base.tolist(), speed.acceleration_m_s2, self._cycle_s)

    def end(self) -> None:
        """Stop speed mode and the program; the arm should be at rest already."""
        if self._control.isConnected() and self._control.isProgramRunning():
            self._control.speedStop(2.0)
            self._control.stopScript()
