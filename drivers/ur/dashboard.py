"""The controller's dashboard: one line out, one line back."""

import socket
from types import TracebackType
from typing import Self

from drivers.errors import ConnectError

DASHBOARD_PORT = 29999


class Dashboard:
    """A connection to the dashboard server; raises ConnectError when it cannot be had."""

    def __init__(self, host: str, timeout_s: float = 5.0) -> None:
        self._host = host
        try:
            self._socket = socket.create_connection((host, DASHBOARD_PORT), timeout_s)
        except OSError as error:
            raise ConnectError(
                f"no dashboard server at {host}:{DASHBOARD_PORT} ({error}): check that the arm is "
                "switched on, its address, and the network"
            ) from error
        self._held = b""
        try:
            self._line()  # the banner
        except BaseException:
            self._socket.close()
            raise

    def ask(self, command: str) -> str:
        """Send a command and return the reply line; raises ConnectError when none comes."""
        try:
            self._socket.sendall(command.encode("ascii") + b"\n")
        except OSError as error:
            raise ConnectError(f"the dashboard at {self._host} hung up: {error}") from error
        return self._line()

    def value(self, command: str) -> str:
        """The part of a reply behind its colon: ``safetystatus`` → ``NORMAL``."""
        return self.ask(command).rpartition(":")[2].strip()

    def close(self) -> None:
        """Hang up."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _line(self) -> str:
        try:
            while b"\n" not in self._held:
                data = self._socket.recv(4096)
                if not data:
                    raise ConnectError(f"the dashboard at {self._host} hung up")
                self._held += data
        except OSError as error:
            if isinstance(error, ConnectError):
                raise
            raise ConnectError(f"the dashboard at {self._host} does not answer: {error}") from error
        line, _, self._held = self._held.partition(b"\n")
        return line.decode("utf-8", errors="replace").strip()
