"""Images from the vision process to this one: a ring in anonymous shared memory.

The file has no name, so nothing is left behind however the processes end. No lock: the writer
fills a slot, raises the count, and only then says in a message which number to look at; the
reader throws away an image that may have been overwritten while it was copied.
"""

import mmap
import os
from typing import Self

import numpy as np

from drivers.interfaces import GreyImage

SLOTS = 32  # one second at 30 Hz
_HEADER_BYTES = 64


class ImageRing:
    """The newest ``SLOTS`` images of one size; both processes map the same open ``file``."""

    def __init__(self, file: int, shape: tuple[int, int]) -> None:
        """Maps ``file``, which stays the caller's to close."""
        self.shape = shape
        self._map = mmap.mmap(file, _size_bytes(shape))
        self._count = np.frombuffer(self._map, dtype=np.int64, count=1)
        pixels = np.frombuffer(self._map, dtype=np.uint8, offset=_HEADER_BYTES)
        self._slots = pixels.reshape(SLOTS, *shape)

    @classmethod
    def create(cls, shape: tuple[int, int]) -> tuple[Self, int]:
        """A new ring and its file."""
        file = os.memfd_create("vision-images", os.MFD_CLOEXEC)
        os.ftruncate(file, _size_bytes(shape))
        return cls(file, shape), file

    def put(self, image: GreyImage) -> int:
        """Add an image; its number, counted from 0."""
        number = int(self._count[0])
        self._slots[number % SLOTS] = image
        self._count[0] = number + 1
        return number

    def get(self, number: int) -> GreyImage | None:
        """A copy of an image; None when newer ones have taken its place."""
        image = self._slots[number % SLOTS].copy()
        return image if self._count[0] - number < SLOTS else None


def _size_bytes(shape: tuple[int, int]) -> int:
    return _HEADER_BYTES + SLOTS * shape[0] * shape[1]
