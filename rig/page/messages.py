"""The few messages between the run and the process that serves its page; states go by the board.

To the page: its address as the first packet, then ``about``, and ``images`` with the file of the
images' ring; hanging up ends it. From the page: one answer, ``Served`` or ``Failed``.
"""

import json
from dataclasses import asdict, dataclass

from rig.config_safety import SafetyConfig
from rig.page.address import PageAddress
from rig.recorded.setup import RunSetup, setup_of, setup_values

MOST_BYTES = 1 << 16


@dataclass(frozen=True, slots=True)
class About:
    """The run that the page shows: what does not change while it lasts."""

    setup: RunSetup
    safety: SafetyConfig
    stoppable: bool  # a past run is not


@dataclass(frozen=True, slots=True)
class ImageShape:
    """From now on images are in the ring whose file came with this message."""

    height: int
    width: int


@dataclass(frozen=True, slots=True)
class Served:
    """The page can be opened."""

    url: str


@dataclass(frozen=True, slots=True)
class Failed:
    """The page cannot be served."""

    reason: str


Message = About | ImageShape | PageAddress | Served | Failed
_PLAIN = {kind.__name__: kind for kind in (ImageShape, PageAddress, Served, Failed)}


def to_bytes(message: Message) -> bytes:
    """The packet."""
    if isinstance(message, About):
        values = {
            "setup": setup_values(message.setup),
            "safety": message.safety.model_dump(mode="json"),
            "stoppable": message.stoppable,
        }
    else:
        values = asdict(message)
    return json.dumps([type(message).__name__, values]).encode()


def message_of(packet: bytes) -> Message:
    """The message in a packet."""
    kind, values = json.loads(packet)
    if kind == About.__name__:
        safety = SafetyConfig.model_validate(values["safety"])
        return About(setup_of(values["setup"]), safety, values["stoppable"])
    message: Message = _PLAIN[kind](**values)
    return message
