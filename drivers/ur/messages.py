"""What parent and child say to each other over their socket pair; one packet, one message."""

import json
import struct
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MOST_BYTES = 4096
_COMMAND = struct.Struct("<B7d")


class Order(IntEnum):
    """What the parent asks for."""

    TWIST = 1
    STOP = 2
    CLOSE = 3


@dataclass(frozen=True, slots=True)
class Command:
    """One order; the twist and its end matter for TWIST only."""

    order: Order
    twist_tool: FloatArray  # (6,)
    until_s: float  # host's monotonic clock

    def to_bytes(self) -> bytes:
        """The packet."""
        return _COMMAND.pack(self.order, *self.twist_tool, self.until_s)


def command_of(packet: bytes) -> Command:
    """The order in a packet; raises ValueError for anything else."""
    try:
        order, *values = _COMMAND.unpack(packet)
    except struct.error as error:
        raise ValueError(f"not a command: {packet!r}") from error
    return Command(Order(order), np.array(values[:6]), values[6])


@dataclass(frozen=True, slots=True)
class Event:
    """What the child reports: "ready", "refused" (cannot start), "lost" or "failed"."""

    kind: str
    text: str
    tcp_offset: tuple[float, ...] = ()
    version: tuple[int, ...] = ()
    rate_hz: float = 0.0
    round_trip_s: float = 0.0  # the shortest of a request to the controller

    def to_bytes(self) -> bytes:
        """The packet."""
        fields = {name: getattr(self, name) for name in Event.__slots__}
        fields["text"] = self.text[: MOST_BYTES // 8]
        return json.dumps(fields).encode()


def event_of(packet: bytes) -> Event:
    """The event in a packet."""
    fields = json.loads(packet)
    fields["tcp_offset"] = tuple(fields["tcp_offset"])
    fields["version"] = tuple(fields["version"])
    return Event(**fields)
