"""The controller's state stream, read from its RTDE port directly.

Not through ``ur_rtde``'s receive interface: its getters read one field at a time from
whichever packet came last and go on returning old values on a dead connection. Here each
packet is one sample with one arrival time.
"""

import socket
import struct

from drivers.clock import Clock
from drivers.errors import ConnectError
from drivers.ur.rtde_codec import FrameBuffer, Kind, Message, Recipe, RtdeError, Value, encode

RTDE_PORT = 30004
_CB3 = 3
_ROUND_TRIPS = 5
_REQUIRED = {
    "timestamp": "DOUBLE",
    "actual_TCP_pose": "VECTOR6D",
    "actual_TCP_speed": "VECTOR6D",
    "actual_q": "VECTOR6D",
    "safety_status_bits": "UINT32",
    "safety_mode": "INT32",
    "robot_mode": "INT32",
    "runtime_state": "UINT32",
    "speed_scaling": "DOUBLE",
}
_OPTIONAL = {"tcp_offset": "VECTOR6D"}  # not known to older controllers


class RtdeStream:
    """A started state stream: 500 Hz, or 125 Hz from a CB3 controller.

    ``round_trip_s`` is the shortest that a request took: more than any sample is delayed for
    sure, and so what its time stamp, mapped to the host's clock, may be off at most.
    Raises ConnectError when the controller cannot be reached or refuses.
    """

    def __init__(self, host: str, clock: Clock, timeout_s: float) -> None:
        self._host = host
        self._clock = clock
        self._deadline_s = clock.now_s() + timeout_s
        self._buffer = FrameBuffer()
        self._pending: list[Message] = []
        try:
            self._socket = socket.create_connection((host, RTDE_PORT), timeout_s)
        except OSError as error:
            raise ConnectError(
                f"no arm controller answers at {host}:{RTDE_PORT} ({error}): check that it is "
                "switched on, its address, and the network"
            ) from error
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._set_up()
        except (OSError, RtdeError, struct.error) as error:
            self.close()
            raise ConnectError(
                f"{host}:{RTDE_PORT} does not speak RTDE as expected: {error}"
            ) from error
        except BaseException:
            self.close()
            raise

    def read(self, timeout_s: float) -> tuple[list[dict[str, Value]], float]:
        """The samples that arrived within ``timeout_s`` (maybe none), and the arrival time.

        Raises ConnectionError when the controller closed the connection, RtdeError on garbage.
        """
        if not self._pending:
            self._receive(timeout_s)
        arrival_s = self._clock.now_s()
        messages, self._pending = self._pending, []
        return [self._unpack(m.payload) for m in messages if m.kind == Kind.DATA], arrival_s

    def close(self) -> None:
        """Hang up."""
        self._socket.close()

    def _set_up(self) -> None:
        if self._request(Kind.PROTOCOL_VERSION, struct.pack(">H", 2))[:1] != b"\x01":
            raise RtdeError("protocol version 2 is refused")
        reply, trips_s = b"", []
        for _ in range(_ROUND_TRIPS):
            asked_s = self._clock.now_s()
            reply = self._request(Kind.CONTROLLER_VERSION)
            trips_s.append(self._clock.now_s() - asked_s)
        self.round_trip_s = min(trips_s)
        self.version: tuple[int, ...] = struct.unpack(">4I", reply)
        self.rate_hz = 500.0 if self.version[0] > _CB3 else 125.0
        wanted = _REQUIRED | _OPTIONAL
        types = self._subscribe(wanted)
        if "NOT_FOUND" in types[len(_REQUIRED) :]:
            wanted = _REQUIRED
            types = self._subscribe(wanted)
        if types != list(wanted.values()):
            raise RtdeError(f"asked for {', '.join(wanted)}, offered {', '.join(types)}")
        self._names = tuple(wanted)
        self._recipe = Recipe(types)
        if self._request(Kind.START) != b"\x01":
            raise RtdeError("the controller does not start its data")

    def _subscribe(self, wanted: dict[str, str]) -> list[str]:
        request = struct.pack(">d", self.rate_hz) + ",".join(wanted).encode()
        reply = self._request(Kind.SETUP_OUTPUTS, request)
        return reply[1:].decode("ascii", errors="replace").split(",")

    def _request(self, kind: Kind, payload: bytes = b"") -> bytes:
        """Send one request and wait for its reply; texts in between are passed over."""
        self._socket.sendall(encode(kind, payload))
        while True:
            while self._pending:
                message = self._pending.pop(0)
                if message.kind == kind:
                    return message.payload
            remaining_s = self._deadline_s - self._clock.now_s()
            if remaining_s <= 0.0:
                raise TimeoutError(f"no reply to request {kind.name}")
            self._receive(remaining_s)

    def _receive(self, timeout_s: float) -> None:
        self._socket.settimeout(max(timeout_s, 1e-3))
        try:
            data = self._socket.recv(65536)
        except TimeoutError:
            return
        if not data:
            raise ConnectionError(f"the controller at {self._host} closed the connection")
        self._pending += self._buffer.feed(data)

    def _unpack(self, payload: bytes) -> dict[str, Value]:
        return dict(zip(self._names, self._recipe.unpack(payload[1:]), strict=True))
