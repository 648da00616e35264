"""One accepted connection, and what a port makes of its bytes."""

import socket
from collections.abc import Callable
from typing import Protocol

from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.script_port import ScriptPort

# A client that does not read has this much waiting before it is hung up on.
_MOST_UNSENT_BYTES = 1 << 20
_LONGEST_LINE = 4096


class Session(Protocol):
    """The protocol side of a connection."""

    def feed(self, data: bytes) -> bytes:
        """The reply to what arrived; raises RtdeError for what ends the connection."""
        ...

    def close(self) -> None:
        """The connection is gone."""
        ...


class Connection:
    """A non-blocking socket that keeps what could not be sent yet."""

    def __init__(self, accepted: socket.socket, port: int, session: Session) -> None:
        accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        accepted.setblocking(False)
        self.socket = accepted
        self.number = accepted.fileno()
        self.port = port
        self.session = session
        self._unsent = bytearray()

    def send(self, data: bytes) -> None:
        """Send, and keep what does not go; raises OSError when the client is gone."""
        self._unsent += data
        try:
            sent = self.socket.send(self._unsent)
        except BlockingIOError:
            sent = 0
        del self._unsent[:sent]
        if len(self._unsent) > _MOST_UNSENT_BYTES:
            raise OSError("the client does not read")

    def close(self) -> None:
        """Hang up."""
        self.session.close()
        self.socket.close()


class ScriptSession:
    """The script port: every complete program is started; nothing is answered."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._port = ScriptPort()

    def feed(self, data: bytes) -> bytes:
        """Start what is complete."""
        for text in self._port.feed(data):
            self._controller.start_program(text)
        return b""

    def close(self) -> None:
        """A program outlives the connection it came by."""


class LineSession:
    """A port of text lines: one line in, one line out."""

    def __init__(self, answer: Callable[[str], str]) -> None:
        self._answer = answer
        self._held = bytearray()

    def feed(self, data: bytes) -> bytes:
        """One reply line per complete line."""
        self._held += data
        *lines, rest = bytes(self._held).split(b"\n")
        self._held = bytearray(rest[-_LONGEST_LINE:])
        replies = [self._answer(line.decode("utf-8", errors="replace")) for line in lines]
        return "".join(reply + "\n" for reply in replies).encode()

    def close(self) -> None:
        """Nothing is kept."""
