"""The RTDE wire format on bytes: frames, field types and packing; no sockets.

Every frame is a big-endian u16 size (its own three header bytes included), a u8 type and a
payload. Source: Universal Robots' RTDE guide, held against what ``ur_rtde`` 1.6.5 sends.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

HEADER_SIZE = 3
MAX_SIZE = 0xFFFF


class RtdeError(Exception):
    """Bytes that are not RTDE, or a field that is not what its type says."""


class Kind(IntEnum):
    """The frame types."""

    PROTOCOL_VERSION = ord("V")
    CONTROLLER_VERSION = ord("v")
    TEXT = ord("M")
    DATA = ord("U")
    SETUP_OUTPUTS = ord("O")
    SETUP_INPUTS = ord("I")
    START = ord("S")
    PAUSE = ord("P")


# Field type -> struct code and how many of them.
FIELD_TYPES: dict[str, tuple[str, int]] = {
    "BOOL": ("?", 1),
    "UINT8": ("B", 1),
    "UINT32": ("I", 1),
    "UINT64": ("Q", 1),
    "INT32": ("i", 1),
    "DOUBLE": ("d", 1),
    "VECTOR3D": ("d", 3),
    "VECTOR6D": ("d", 6),
    "VECTOR6INT32": ("i", 6),
    "VECTOR6UINT32": ("I", 6),
}

Scalar = float | int | bool
Value = Scalar | tuple[Scalar, ...]


@dataclass(frozen=True, slots=True)
class Message:
    """One frame, taken apart."""

    kind: int
    payload: bytes


def encode(kind: int, payload: bytes = b"") -> bytes:
    """One frame; raises RtdeError when the payload does not fit into its 16-bit size."""
    size = HEADER_SIZE + len(payload)
    if size > MAX_SIZE:
        raise RtdeError(f"a payload of {len(payload)} bytes does not fit into one frame")
    return struct.pack(">HB", size, kind) + payload


class FrameBuffer:
    """Cuts a byte stream into frames, however the network chopped it."""

    def __init__(self) -> None:
        self._held = bytearray()

    def feed(self, data: bytes) -> list[Message]:
        """The frames completed by ``data``, in order.

        Raises RtdeError for a size below the header's own; the stream cannot be trusted after.
        """
        self._held += data
        out: list[Message] = []
        at = 0
        while len(self._held) - at >= HEADER_SIZE:
            size, kind = struct.unpack_from(">HB", self._held, at)
            if size < HEADER_SIZE:
                raise RtdeError(f"a frame claims to be {size} bytes long: this is not RTDE")
            if len(self._held) - at < size:
                break
            out.append(Message(kind, bytes(self._held[at + HEADER_SIZE : at + size])))
            at += size
        del self._held[:at]
        return out


def split_names(text: bytes) -> list[str]:
    """Names of a comma-separated list; ``ur_rtde`` ends its lists in a comma, others do not."""
    try:
        names = text.decode("ascii").split(",")
    except UnicodeDecodeError as error:
        raise RtdeError("a variable list that is not ASCII") from error
    return [name.strip() for name in names if name.strip()]


class Recipe:
    """An ordered set of fields, packed and unpacked as one payload."""

    def __init__(self, types: Sequence[str]) -> None:
        unknown = [name for name in types if name not in FIELD_TYPES]
        if unknown:
            raise RtdeError(f"unknown field types: {', '.join(unknown)}")
        self.types = tuple(types)
        self._counts = [FIELD_TYPES[name][1] for name in types]
        codes = "".join(FIELD_TYPES[name][0] * FIELD_TYPES[name][1] for name in types)
        self._struct = struct.Struct(">" + codes)

    @property
    def size(self) -> int:
        """Bytes of one packed payload."""
        return self._struct.size

    def pack(self, values: Sequence[Value]) -> bytes:
        """The payload of one value per field; raises RtdeError when they do not fit the types."""
        flat: list[Scalar] = []
        for value in values:
            if isinstance(value, tuple):
                flat.extend(value)
            else:
                flat.append(value)
        try:
            return self._struct.pack(*flat)
        except struct.error as error:
            raise RtdeError(f"values do not fit {','.join(self.types)}: {error}") from error

    def unpack(self, payload: bytes) -> list[Value]:
        """One value per field, vectors as tuples; raises RtdeError for a wrong length."""
        if len(payload) != self._struct.size:
            raise RtdeError(f"a data frame has {len(payload)} bytes, {self._struct.size} expected")
        flat = self._struct.unpack(payload)
        out: list[Value] = []
        at = 0
        for count in self._counts:
            out.append(flat[at] if count == 1 else flat[at : at + count])
            at += count
        return out
