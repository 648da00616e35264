"""The whole records of an MCAP file, also of one that ends anywhere.

A file whose writer was killed may stop inside a record; what follows the last whole one must not
be taken for data. The official reader refuses such files, so the outermost layer (an opcode, a
length, that many bytes) is walked here; what is in the records is read by the official classes.
"""

import io
import struct
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import IO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from drivers.errors import ConfigError

_HEAD = struct.Struct("<BQ")  # opcode, length


_READ: dict[int, Callable[[ReadDataStream, int], McapRecord]] = {
    Opcode.SCHEMA: lambda stream, _: Schema.read(stream),
    Opcode.CHANNEL: lambda stream, _: Channel.read(stream),
    Opcode.CHUNK: lambda stream, _: Chunk.read(stream),
    Opcode.ATTACHMENT: lambda stream, _: Attachment.read(stream),
    Opcode.METADATA: lambda stream, _: Metadata.read(stream),
    Opcode.MESSAGE: Message.read,
}


def whole_until(file: IO[bytes]) -> tuple[int, bool]:
    """Where the last whole record ends, and whether the file was closed in order.

    Raises ConfigError when it does not begin as an MCAP file.
    """
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
        raise ConfigError(f"{getattr(file, 'name', 'the file')} is not an MCAP file")
    end = len(MCAP0_MAGIC)
    while True:
        head = file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            return end, False
        opcode, length = _HEAD.unpack(head)
        following = end + _HEAD.size + length
        if opcode == 0 or following > size:
            return end, False
        file.seek(following)
        end = following
        if opcode == Opcode.FOOTER:
            return end, file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC


def data_section(
    path: Path, end: int, opcodes: Collection[int] = tuple(_READ)
) -> Iterator[McapRecord]:
    """The records that hold data, chunks closed, up to ``end`` or the index.

    Others than those of ``opcodes`` are stepped over.
    """
    with path.open("rb") as file:
        at = file.seek(len(MCAP0_MAGIC))
        while at + _HEAD.size <= end:
            opcode, length = _HEAD.unpack(file.read(_HEAD.size))
            at += _HEAD.size + length
            if opcode == Opcode.DATA_END:
                return
            if opcode in opcodes:
                yield _READ[opcode](ReadDataStream(io.BytesIO(file.read(length))), length)
            else:
                file.seek(at)
