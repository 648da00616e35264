"""How far an MCAP file is whole, and a stream that ends there.

A file whose writer was killed ends anywhere, also inside a record; what follows the last whole
record must not be taken for data.
"""

import io
import struct
from pathlib import Path
from typing import IO, Any

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from drivers.errors import ConfigError

_HEAD = struct.Struct("<BQ")  # opcode, length


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


class Prefix(io.RawIOBase):
    """The first ``end`` bytes of a file, read as if there were no more."""

    def __init__(self, path: Path, end: int) -> None:
        self._file = path.open("rb")
        self._left = end

    def readable(self) -> bool:
        """It is."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill ``buffer`` as far as there is something."""
        view = memoryview(buffer)[: self._left]
        count = self._file.readinto(view)
        self._left -= count
        return int(count)

    def close(self) -> None:
        """Close the file too."""
        self._file.close()
        super().close()
