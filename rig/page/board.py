"""Shared memory between the control loop and the page: states one way, stop requests the other.

Nobody waits for anybody. The writer overwrites the oldest of a fixed number of slots, so that a
page that is slow, stopped or dead loses states and costs the loop nothing; a stop request is a
count that goes up. No lock: the writer fills a slot before it raises the count, and the reader
throws away what may have been overwritten while it was copied.
"""

import mmap
import os
import struct
from typing import Self

import numpy as np

SLOTS = 128
SLOT_BYTES = 4096
_HEADER_BYTES = 64
_LENGTH = struct.Struct("<I")
_POSTED, _STOPS = 0, 1  # places in the header


class Board:
    """One end; both processes map the same open ``file``."""

    def __init__(self, file: int) -> None:
        """Maps ``file``, which stays the caller's to close."""
        self._map = mmap.mmap(file, _HEADER_BYTES + SLOTS * SLOT_BYTES)
        self._counts = np.frombuffer(self._map, dtype=np.int64, count=_HEADER_BYTES // 8)
        self._taken = 0

    @classmethod
    def create(cls) -> tuple[Self, int]:
        """A new board and its file, which has no name: nothing is left behind."""
        file = os.memfd_create("page", os.MFD_CLOEXEC)
        os.ftruncate(file, _HEADER_BYTES + SLOTS * SLOT_BYTES)
        return cls(file), file

    @property
    def stop_requests(self) -> int:
        """How often the page asked for a stop."""
        return int(self._counts[_STOPS])

    def request_stop(self) -> None:
        """Ask for a stop."""
        self._counts[_STOPS] += 1

    def post(self, message: bytes) -> None:
        """Add a message in the oldest one's place; one too long for a slot is dropped."""
        if len(message) > SLOT_BYTES - _LENGTH.size:
            return
        number = int(self._counts[_POSTED])
        start = self._start(number)
        self._map[start : start + _LENGTH.size] = _LENGTH.pack(len(message))
        start += _LENGTH.size
        self._map[start : start + len(message)] = message
        self._counts[_POSTED] = number + 1

    def take(self) -> list[bytes]:
        """Messages posted since the last call, oldest first, as far as they are still there."""
        posted = int(self._counts[_POSTED])
        first = max(self._taken, posted - SLOTS + 1)
        copies = [(number, self._copy(number)) for number in range(first, posted)]
        self._taken = posted
        oldest_whole = int(self._counts[_POSTED]) - SLOTS + 1
        return [copy for number, copy in copies if number >= oldest_whole]

    def _copy(self, number: int) -> bytes:
        start = self._start(number)
        (length,) = _LENGTH.unpack(self._map[start : start + _LENGTH.size])
        start += _LENGTH.size
        return bytes(self._map[start : start + min(length, SLOT_BYTES - _LENGTH.size)])

    @staticmethod
    def _start(number: int) -> int:
        return _HEADER_BYTES + (number % SLOTS) * SLOT_BYTES
