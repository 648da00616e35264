"""Samples from the child to the parent: a ring in shared memory, one writer and one reader.

No lock: the writer fills a row and then raises the count; on the processors this runs on
(x86-64, and Linux wheels of ``ur_rtde`` exist for nothing else) stores become visible in order.
The reader throws away what may have been overwritten while it copied.
"""

import mmap
import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

CAPACITY = 4096  # 8 s at 500 Hz
_GUARD = 64  # rows closest to being overwritten are not trusted
_WIDTH = 40
_HEADER_BYTES = 64


@dataclass(frozen=True, slots=True)
class Sample:
    """One state of the controller."""

    t_s: float  # host's monotonic clock: when it was true
    arrival_s: float  # when it came
    controller_s: float  # the controller's own time stamp
    T_base_tool: FloatArray  # (4, 4)
    twist_base: FloatArray  # (6,) of the TCP in base axes
    q_rad: FloatArray  # (6,)
    tcp_offset: FloatArray  # (6,) m and rad, NaN where the controller does not say
    safety_status_bits: int
    safety_mode: int
    robot_mode: int
    runtime_state: int
    speed_scaling: float


def _to_row(sample: Sample) -> FloatArray:
    row = np.zeros(_WIDTH)
    row[0], row[1], row[2] = sample.t_s, sample.arrival_s, sample.controller_s
    row[3:15] = sample.T_base_tool[:3].ravel()
    row[15:21] = sample.twist_base
    row[21:27] = sample.q_rad
    row[27:33] = sample.tcp_offset
    row[33] = sample.safety_status_bits
    row[34] = sample.safety_mode
    row[35] = sample.robot_mode
    row[36] = sample.runtime_state
    row[37] = sample.speed_scaling
    return row


def _from_row(row: FloatArray) -> Sample:
    T = np.eye(4)
    T[:3] = row[3:15].reshape(3, 4)
    return Sample(
        t_s=float(row[0]),
        arrival_s=float(row[1]),
        controller_s=float(row[2]),
        T_base_tool=T,
        twist_base=row[15:21].copy(),
        q_rad=row[21:27].copy(),
        tcp_offset=row[27:33].copy(),
        safety_status_bits=int(row[33]),
        safety_mode=int(row[34]),
        robot_mode=int(row[35]),
        runtime_state=int(row[36]),
        speed_scaling=float(row[37]),
    )


class SampleRing:
    """The ring on an open file of ``size_bytes``; both processes map the same one."""

    size_bytes = _HEADER_BYTES + CAPACITY * _WIDTH * 8

    def __init__(self, file: int) -> None:
        self._map = mmap.mmap(file, self.size_bytes)
        self._count = np.frombuffer(self._map, dtype=np.int64, count=1)
        self._rows = np.frombuffer(self._map, dtype=np.float64, offset=_HEADER_BYTES).reshape(
            CAPACITY, _WIDTH
        )

    @property
    def count(self) -> int:
        """Samples ever published."""
        return int(self._count[0])

    def publish(self, sample: Sample) -> None:
        """Add the newest sample."""
        n = self.count
        self._rows[n % CAPACITY] = _to_row(sample)
        self._count[0] = n + 1

    def newest(self) -> Sample | None:
        """The latest sample, None before the first."""
        samples, _ = self.since(self.count - 1)
        return samples[-1] if samples else None

    def since(self, number: int) -> tuple[list[Sample], int]:
        """Samples from ``number`` on (they count from 0) as far as still held, and the number
        to ask for next time.
        """
        count = self.count
        first = max(number, 0, count - (CAPACITY - _GUARD))
        numbers = np.arange(first, count)
        rows = self._rows[numbers % CAPACITY]
        still_whole = numbers > self.count - CAPACITY
        return [_from_row(row) for row in rows[still_whole]], count


def make_ring_file() -> int:
    """An anonymous file for a ring; it vanishes with the last process that has it open."""
    file = os.memfd_create("arm-states", 0)
    os.ftruncate(file, SampleRing.size_bytes)
    return file
