"""One client's RTDE connection: requests in, replies out, and its subscribed data; no sockets.

Input recipes are numbered 1, 2, 3 … per connection, as ``ur_rtde`` counts them. An input
belongs to the first connection that asked for it until that one closes.
"""

import math
import struct
from enum import IntEnum

from drivers.ur.rtde_codec import (
    FrameBuffer,
    Kind,
    Message,
    Recipe,
    RtdeError,
    Value,
    encode,
    split_names,
)
from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.variables import INPUTS, OUTPUTS, outputs_of, zero_of

_KNOWN_VERSIONS = (1, 2)
_SOURCE = b"loopback controller"
_LONGEST_TEXT = 255


class Level(IntEnum):
    """How bad a text message is."""

    EXCEPTION = 0
    ERROR = 1
    WARNING = 2
    INFO = 3


class RtdeSession:
    """The protocol state of one connection."""

    def __init__(self, controller: Controller, owners: dict[str, "RtdeSession"]) -> None:
        self._controller = controller
        self._owners = owners  # of input names, shared by all connections
        self._buffer = FrameBuffer()
        self._version = 1
        self._known_outputs = outputs_of(controller.config.version)
        self._outputs: tuple[str, ...] = ()
        self._output_recipe: Recipe | None = None
        self._divider = 1
        self._inputs: list[tuple[tuple[str, ...], Recipe | None]] = []
        self.started = False

    def feed(self, data: bytes) -> bytes:
        """The replies to whatever requests ``data`` completes.

        Raises RtdeError for what no client may send; the connection is then to be closed.
        """
        return b"".join(self._answer(message) for message in self._buffer.feed(data))

    @property
    def due(self) -> bool:
        """Whether the client is to get this cycle's data."""
        return self.started and self._controller.cycle % self._divider == 0

    def text_frame(self, text: str, level: Level) -> bytes:
        """A text message; empty while the client is being set up, when it expects none."""
        if not self.started:
            return b""
        words = text.encode()[:_LONGEST_TEXT]
        if self._version < 2:
            return encode(Kind.TEXT, bytes([level]) + words)
        message = bytes([len(words)]) + words + bytes([len(_SOURCE)]) + _SOURCE
        return encode(Kind.TEXT, message + bytes([level]))

    def data_frame(self, outputs: dict[str, Value]) -> bytes:
        """This cycle's data for the client; empty when it wants none now."""
        recipe = self._output_recipe
        if recipe is None or not self.due:
            return b""
        values = [
            outputs[name] if name in outputs else zero_of(OUTPUTS[name]) for name in self._outputs
        ]
        prefix = b"\x01" if self._version >= 2 else b""
        return encode(Kind.DATA, prefix + recipe.pack(values))

    def close(self) -> None:
        """Give the inputs back."""
        for name in [name for name, owner in self._owners.items() if owner is self]:
            del self._owners[name]

    def _answer(self, message: Message) -> bytes:
        payload = message.payload
        match message.kind:
            case Kind.PROTOCOL_VERSION:
                return self._negotiate(payload)
            case Kind.CONTROLLER_VERSION:
                return encode(message.kind, struct.pack(">4I", *self._controller.config.version))
            case Kind.SETUP_OUTPUTS:
                return self._setup_outputs(payload)
            case Kind.SETUP_INPUTS:
                return self._setup_inputs(payload)
            case Kind.START:
                self.started = self._output_recipe is not None
                return encode(message.kind, bytes([self.started]))
            case Kind.PAUSE:
                self.started = False
                return encode(message.kind, b"\x01")
            case Kind.DATA:
                self._take(payload)
                return b""
            case Kind.TEXT:
                return b""
            case _:
                raise RtdeError(f"unknown request {message.kind}")

    def _negotiate(self, payload: bytes) -> bytes:
        if len(payload) != 2:
            raise RtdeError("a protocol version is two bytes")
        wanted = struct.unpack(">H", payload)[0]
        accepted = wanted in _KNOWN_VERSIONS
        if accepted:
            self._version = wanted
        return encode(Kind.PROTOCOL_VERSION, bytes([accepted]))

    def _setup_outputs(self, payload: bytes) -> bytes:
        most_hz = rate_hz = self._controller.config.rate_hz
        if self._version >= 2:
            if len(payload) < 8:
                raise RtdeError("an output set-up of protocol 2 starts with a frequency")
            rate_hz = struct.unpack(">d", payload[:8])[0]
            payload = payload[8:]
        names = split_names(payload)
        types = [self._known_outputs.get(name, "NOT_FOUND") for name in names]
        valid = bool(names) and "NOT_FOUND" not in types
        valid = valid and math.isfinite(rate_hz) and 0.0 < rate_hz <= most_hz
        self.started = False
        self._outputs = tuple(names)
        self._output_recipe = Recipe(types) if valid else None
        ticks = max(1, round(most_hz / rate_hz)) if valid else 1
        self._divider = ticks * self._controller.config.cycles_per_tick
        prefix = bytes([valid]) if self._version >= 2 else b""
        return encode(Kind.SETUP_OUTPUTS, prefix + ",".join(types).encode())

    def _setup_inputs(self, payload: bytes) -> bytes:
        names = split_names(payload)
        types = [self._input_type(name) for name in names]
        refused = not names or "NOT_FOUND" in types or "IN_USE" in types
        if len(self._inputs) == 255:
            raise RtdeError("more than 255 input recipes")
        self._inputs.append((tuple(names), None if refused else Recipe(types)))
        number = 0 if refused else len(self._inputs)
        if not refused:
            self._owners.update(dict.fromkeys(names, self))
        return encode(Kind.SETUP_INPUTS, bytes([number]) + ",".join(types).encode())

    def _input_type(self, name: str) -> str:
        if name not in INPUTS:
            return "NOT_FOUND"
        return "IN_USE" if self._owners.get(name, self) is not self else INPUTS[name]

    def _take(self, payload: bytes) -> None:
        number = payload[0] if payload else 0
        if not 1 <= number <= len(self._inputs):
            raise RtdeError(f"data for the unknown input recipe {number}")
        names, recipe = self._inputs[number - 1]
        if recipe is not None:
            values = recipe.unpack(payload[1:])
            self._controller.write_inputs(dict(zip(names, values, strict=True)))
