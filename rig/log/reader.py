"""Reading a log, also one that its writer never finished."""

import json
import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import orjson
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    McapRecord,
    Message,
    Metadata,
)
from mcap.stream_reader import breakup_chunk
from zstandard import ZstdError

from drivers.errors import ConfigError
from drivers.interfaces import GreyImage
from rig.log.pixels import image_of
from rig.log.prefix import data_section, whole_until
from rig.log.run_log import LOG_NAME
from rig.log.topics import BY_NAME, Topic

_DAMAGE = (McapError, ZstdError, RuntimeError, ValueError, struct.error, MemoryError)


@dataclass(frozen=True, slots=True)
class Record:
    """One message of a log."""

    topic: Topic
    logged_ns: int
    t_ns: int  # when it was true
    data: bytes

    @property
    def kind(self) -> str:
        """What it is, as in exports."""
        return self.topic.kind

    def values(self) -> dict[str, Any]:
        """What a record in JSON says."""
        values: dict[str, Any] = orjson.loads(self.data)
        return values

    def message(self) -> Any:
        """A protobuf message."""
        assert self.topic.message is not None
        return self.topic.message.FromString(self.data)

    def image(self) -> GreyImage:
        """The image (height, width) of a record of the kinds image and raw_image."""
        return image_of(self.message())


@dataclass(slots=True)
class Log:
    """A log file; ``finished`` tells whether it was closed in order."""

    path: Path
    finished: bool
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, bytes]
    end: int  # bytes that can be read
    damaged_chunks: int = field(default=0)  # met by the last ``records``

    @property
    def path_bytes(self) -> int:
        """The file's size."""
        return self.path.stat().st_size

    def metadata_values(self, name: str) -> dict[str, Any]:
        """A metadata record whose texts are JSON; empty when there is none."""
        return {key: json.loads(text) for key, text in self.metadata.get(name, {}).items()}

    def records(self, kinds: Collection[str] | None = None) -> Iterator[Record]:
        """The messages of some kinds (default: all known ones) in the order they were logged.

        A chunk that does not hold what was written is left out and counted.
        """
        topics: dict[int, Topic | None] = {}
        self.damaged_chunks = 0
        for item in self.raw():
            if isinstance(item, Channel):
                topic = BY_NAME.get(item.topic)
                wanted = topic is not None and (kinds is None or topic.kind in kinds)
                topics[item.id] = topic if wanted else None
            elif isinstance(item, Message):
                topic = topics.get(item.channel_id)
                if topic is not None:
                    yield Record(topic, item.log_time, item.publish_time, item.data)

    def raw(self) -> Iterator[McapRecord]:
        """Everything of the data section, chunks opened."""
        for item in data_section(self.path, self.end):
            if not isinstance(item, Chunk):
                yield item
                continue
            try:
                inner = breakup_chunk(item, validate_crc=True)
            except _DAMAGE:
                self.damaged_chunks += 1
                continue
            yield from inner


def find_log(path: Path) -> Path:
    """The log that a path names: itself, or the one of a run directory.

    Raises ConfigError when there is none.
    """
    if path.is_dir():
        inside = path / LOG_NAME
        if not inside.is_file():
            raise ConfigError(f"{path} holds no {LOG_NAME}")
        return inside
    if not path.is_file():
        raise ConfigError(f"there is no log {path}")
    return path


def open_log(path: Path) -> Log:
    """A log file, or the one in a run directory; raises ConfigError for anything else."""
    path = find_log(path)
    try:
        with path.open("rb") as file:
            end, finished = whole_until(file)
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error}") from error
    log = Log(path, finished, {}, {}, end)
    for item in data_section(path, end, (Opcode.METADATA, Opcode.ATTACHMENT)):
        if isinstance(item, Metadata):
            log.metadata[item.name] = item.metadata
        elif isinstance(item, Attachment):
            log.attachments[item.name] = item.data
    return log
