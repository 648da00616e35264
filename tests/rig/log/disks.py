"""Files on disks of every temper, and entries to write to them."""

import io
import threading
from pathlib import Path

import numpy as np

from drivers.interfaces import Frame
from estimator.image.feature import Measurement
from rig.config_log import LogConfig
from rig.log.encode import Encoder
from rig.log.entry import Happened, Picture, Ticked
from rig.log.mcap_file import McapFile
from rig.log.recorder import Recorder
from sim_backend.clock import SimulatedClock
from tests.rig.fakes import INTRINSICS

PATIENCE_S = 10.0
IMAGE = np.zeros((1024, 1024), np.uint8)  # a megabyte
NOTHING_FOUND = Measurement(None, "")


class StuckDisk(io.BytesIO):
    """Takes nothing until a test says otherwise."""

    def __init__(self) -> None:
        super().__init__()
        self.stuck = False
        self.reached = threading.Event()
        self.free = threading.Event()
        self.kept = b""

    def write(self, data: object) -> int:
        if self.stuck:
            self.reached.set()
            assert self.free.wait(PATIENCE_S)
        return super().write(data)  # type: ignore[arg-type]

    def close(self) -> None:
        self.kept = self.getvalue()
        super().close()


class FullDisk(io.FileIO):
    """Has room for so many bytes and not one more."""

    def __init__(self, path: Path, room_bytes: int) -> None:
        super().__init__(path, "w")
        self._room_bytes = room_bytes

    def write(self, data: object) -> int:
        fits = memoryview(data)[: max(0, self._room_bytes - self.tell())]  # type: ignore[call-overload]
        if len(fits) == 0:
            raise OSError(28, "No space left on device")
        return super().write(fits)


def encoder(images: str = "raw") -> Encoder:
    """Writes images as they are asked for; nothing else of it matters."""
    return Encoder(LogConfig(images=images), INTRINSICS, np.eye(4))


def recorder(file: io.IOBase, path: Path, warnings: list[str], realtime: bool = True) -> Recorder:
    """A recorder on a file."""
    clock = SimulatedClock() if realtime else None
    return Recorder(McapFile(path, file), encoder(), clock, warnings.append)  # type: ignore[arg-type]


def picture(seq: int) -> Picture:
    """One image of a megabyte."""
    return Picture(Frame(IMAGE, 0.001 * seq, 0.0, seq, "test"))


def tick(number: int) -> Ticked:
    """One tick a millisecond."""
    return Ticked(0.001 * number, 0.0, number)


def event(t_s: float, name: str) -> Happened:
    """An event."""
    return Happened(t_s, name, "")
