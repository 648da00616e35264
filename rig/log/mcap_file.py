"""One MCAP file being written: channels as they are needed, chunks closed on demand."""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import IO

from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from rig.log.encode import Message
from rig.log.topics import BY_KIND, Topic

_CHUNK_BYTES = 1 << 20
_MEDIA = {".yaml": "application/yaml", ".json": "application/json"}


class McapFile:
    """Writes messages; what has been flushed is readable whatever happens afterwards."""

    def __init__(self, path: Path, file: IO[bytes]) -> None:
        """``file`` is ``path`` opened for writing; raises OSError where that fails."""
        self._path = path
        self._file = file
        self._writer = Writer(file, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library="activerig")
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._sequence: dict[int, int] = {}
        self._whole_bytes = 0

    @property
    def size_bytes(self) -> int:
        """What is known to be in the file."""
        return self._whole_bytes

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write named texts."""
        self._writer.add_metadata(name, dict(values))

    def attach(self, name: str, data: bytes, t_ns: int) -> None:
        """Write a file into the file."""
        media = _MEDIA.get(Path(name).suffix, "application/octet-stream")
        self._writer.add_attachment(t_ns, t_ns, name, media, data)

    def write(self, message: Message, logged_ns: int) -> None:
        """Write one message; raises OSError when the disk takes no more."""
        channel = self._channels.get(message.kind)
        if channel is None:
            channel = self._channels[message.kind] = self._new_channel(BY_KIND[message.kind])
        number = self._sequence[channel] = self._sequence.get(channel, 0) + 1
        self._writer.add_message(channel, logged_ns, message.data, message.t_ns, number)

    def flush(self) -> None:
        """Close the chunk and hand everything to the system."""
        self._writer.flush()
        self._whole_bytes = self._file.tell()

    def close(self) -> None:
        """Write the index and close."""
        self._writer.finish()
        self._file.flush()
        self._whole_bytes = self._file.tell()
        self._file.close()

    def abandon(self) -> None:
        """Close after a failed write; what was flushed stays, and nothing half written."""
        with suppress(OSError):
            self._file.close()
        with suppress(OSError):
            os.truncate(self._path, self._whole_bytes)

    def _new_channel(self, topic: Topic) -> int:
        name = topic.schema_name
        if name not in self._schemas:
            if topic.message is not None:
                self._schemas[name] = register_schema(self._writer, topic.message)
            else:
                schema = json.dumps({"title": name, **topic.schema}).encode()
                self._schemas[name] = self._writer.register_schema(name, "jsonschema", schema)
        return self._writer.register_channel(topic.name, topic.encoding, self._schemas[name])
