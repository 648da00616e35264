"""An RTDE client written from the protocol's published guide alone, in protocol 1 or 2.

Nothing of the project's own codec is used here: what the two understand differently shows.
"""

import socket
import struct
import time
from dataclasses import dataclass

RTDE_PORT = 30004
_CODES = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}


@dataclass(frozen=True, slots=True)
class Text:
    """A text message from the controller."""

    message: str
    source: str
    level: int


class PlainClient:
    """One connection; every wait ends after 5 s at the latest."""

    def __init__(self, host: str, protocol: int = 2) -> None:
        self.socket = socket.create_connection((host, RTDE_PORT), 5.0)
        self.protocol = protocol
        self.texts: list[Text] = []
        self._held = b""
        self._format = ""
        if protocol != 1:  # a client that does not ask speaks protocol 1
            assert self.ask("V", struct.pack(">H", protocol)) == b"\x01"

    def send(self, kind: str, payload: bytes = b"") -> None:
        """One package."""
        self.socket.sendall(struct.pack(">H", len(payload) + 3) + kind.encode() + payload)

    def receive(self) -> tuple[str, bytes]:
        """The next package; raises ConnectionError when the controller hung up."""
        self._fill(3)
        size = struct.unpack(">H", self._held[:2])[0]
        self._fill(size)
        package, self._held = self._held[:size], self._held[size:]
        return chr(package[2]), package[3:]

    def ask(self, kind: str, payload: bytes = b"") -> bytes:
        """The reply to a request; data and texts that come before it are passed over."""
        self.send(kind, payload)
        deadline_s = time.monotonic() + 5.0
        while time.monotonic() < deadline_s:
            got, reply = self.receive()
            if got == kind:
                return reply
        raise TimeoutError(f"no reply to {kind}")

    def version(self) -> tuple[int, ...]:
        """The controller's version."""
        return struct.unpack(">IIII", self.ask("v"))

    def outputs(self, names: str, frequency_hz: float | None = None) -> list[str]:
        """Subscribe; the types of the names."""
        asked = names.encode()
        if self.protocol == 2:
            asked = struct.pack(">d", 500.0 if frequency_hz is None else frequency_hz) + asked
        reply = self.ask("O", asked)
        if self.protocol == 2:
            reply = reply[1:]  # the recipe's number
        types = reply.decode().split(",")
        if all(kind in _CODES for kind in types):
            self._format = ">" + "".join(_CODES[kind] for kind in types)
        return types

    def inputs(self, names: str) -> tuple[int, list[str]]:
        """Claim inputs; the recipe's number (0: refused) and the types."""
        reply = self.ask("I", names.encode())
        return reply[0], reply[1:].decode().split(",")

    def write(self, recipe: int, packed: bytes) -> None:
        """Send values for an input recipe."""
        self.send("U", bytes([recipe]) + packed)

    def start(self) -> bool:
        """Let the data come; whether the controller agreed."""
        return self.ask("S") == b"\x01"

    def pause(self) -> bool:
        """Stop the data; whether the controller agreed."""
        return self.ask("P") == b"\x01"

    def data(self) -> tuple[float, ...]:
        """The numbers of the next data package, one after another; texts are kept aside."""
        while True:
            kind, payload = self.receive()
            if kind == "M":
                self.texts.append(self._text(payload))
            if kind == "U":
                return struct.unpack(self._format, payload[self.protocol - 1 :])

    def waiting(self, for_s: float) -> bool:
        """Whether anything arrives within a time."""
        self.socket.settimeout(for_s)
        try:
            self._held += self.socket.recv(65536)
        except TimeoutError:
            return False
        finally:
            self.socket.settimeout(5.0)
        return True

    def close(self) -> None:
        """Hang up."""
        self.socket.close()

    def _text(self, payload: bytes) -> Text:
        if self.protocol == 1:
            return Text(payload[1:].decode(), "", payload[0])
        end = 1 + payload[0]
        source_end = end + 1 + payload[end]
        message, source = payload[1:end], payload[end + 1 : source_end]
        return Text(message.decode(), source.decode(), payload[source_end])

    def _fill(self, size: int) -> None:
        while len(self._held) < size:
            data = self.socket.recv(65536)
            if not data:
                raise ConnectionError("the controller hung up")
            self._held += data
