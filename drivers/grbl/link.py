"""A byte pipe to the controller, and the one made of a serial port."""

import importlib
from typing import Any, Protocol

from drivers.errors import ConnectError
from drivers.grbl.errors import PortLostError

_WRITE_TIMEOUT_S = 0.1


class Link(Protocol):
    """Bytes in and out; both raise PortLostError when the line is gone."""

    def read(self, timeout_s: float) -> bytes:
        """What has arrived, waiting up to ``timeout_s`` for the first byte."""
        ...

    def write(self, data: bytes) -> None:
        """Send ``data``."""
        ...

    def close(self) -> None:
        """Release the line; harmless when repeated."""
        ...


class SerialLink:
    """A serial port through pyserial, opened for this program alone."""

    def __init__(self, port: str, baud: int) -> None:
        """Raises ConnectError where pyserial is missing or the port cannot be opened."""
        self._port_name = port
        try:
            self._serial: Any = importlib.import_module("serial")
        except ImportError as error:
            raise ConnectError(
                "the serial gantry needs the package pyserial: type `pip install pyserial`"
            ) from error
        try:
            self._port: Any = self._serial.Serial(
                port, baud, timeout=0.0, write_timeout=_WRITE_TIMEOUT_S, exclusive=True
            )
        except (self._serial.SerialException, OSError, ValueError) as error:
            raise ConnectError(_why_not_opened(port, error)) from error

    def read(self, timeout_s: float) -> bytes:
        """What has arrived, waiting up to ``timeout_s`` for the first byte."""
        try:
            if self._port.timeout != timeout_s:
                self._port.timeout = timeout_s
            first: bytes = self._port.read(1)
            if first and self._port.in_waiting:
                first += self._port.read(self._port.in_waiting)
        except (self._serial.SerialException, OSError, TypeError) as error:
            raise self._lost(error) from error
        return first

    def write(self, data: bytes) -> None:
        """Send ``data``; a line that takes nothing for 0.1 s counts as lost."""
        try:
            self._port.write(data)
        except (self._serial.SerialException, OSError, TypeError) as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Release the port."""
        try:
            self._port.close()
        except (self._serial.SerialException, OSError):
            return  # it is gone already

    def _lost(self, error: Exception) -> PortLostError:
        return PortLostError(
            f"the serial port {self._port_name} is gone ({error}): plug the gantry in again, "
            f"then `rig arm recover --arm grbl --port {self._port_name}`"
        )


def _why_not_opened(port: str, error: Exception) -> str:
    text = str(error)
    if "Permission" in text:
        what = "you may not open it: type `sudo usermod -aG dialout $USER`, then log in again"
    elif "No such file" in text or ("could not open port" in text and "Errno 2" in text):
        what = "there is no such port: look into /dev/serial/by-id"
    elif "exclusively lock" in text:
        what = "another program uses it: close that first"
    else:
        what = "check the port's name and the cable"
    return f"cannot open the gantry's port {port} ({text}): {what}"
