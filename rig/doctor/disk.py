"""The disk that runs are written to: fast enough, never stalling, with room."""

import os
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from drivers.clock import Clock
from rig.doctor.finding import Finding, Status, Value
from rig.doctor.subject import Subject

# What the log of a run writes, rounded up: a UR's 500 states a second are most of it.
LOG_BYTES_S = 0.5e6
_BLOCK = bytes(1 << 20)
_LINE = b"x" * 4095 + b"\n"
_LINES = 1000
_LEAST_MARGIN = 10.0
_STALL_S = 0.2  # a thread of its own writes the log, so that a busy disk holds up nothing else
_LEAST_ROOM_S = 3600.0


@dataclass(frozen=True, slots=True)
class DiskFacts:
    """What writing to a folder costs."""

    folder: Path
    speed_bytes_s: float  # in large blocks, until it is on the disk
    longest_write_s: float  # of a 4 kB line
    free_bytes: int


def disk(subject: Subject, clock: Clock) -> Finding:
    """Write to where runs go, into a file without a name, and time it."""
    folder = existing_parent(subject.runs)
    try:
        return judge_disk(measure(folder, clock, 8 if subject.quick else 64))
    except OSError as error:
        return Finding(
            "disk",
            Status.FAIL,
            f"runs cannot be written below {folder}: {error.strerror or error}",
            "start `rig` in a folder you may write to, or give --out",
            {"folder": str(folder)},
        )


def existing_parent(path: Path) -> Path:
    """The folder itself, or the nearest above it that exists."""
    path = path.absolute()
    return next((p for p in (path, *path.parents) if p.is_dir()), Path("/"))


def measure(folder: Path, clock: Clock, blocks: int) -> DiskFacts:
    """Write ``blocks`` MiB and a thousand lines below ``folder``; raises OSError."""
    with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
        start_s = clock.now_s()
        for _ in range(blocks):
            file.write(_BLOCK)
        os.fsync(file.fileno())
        speed_bytes_s = blocks * len(_BLOCK) / max(clock.now_s() - start_s, 1e-9)
        longest_s = 0.0
        for _ in range(_LINES):
            before_s = clock.now_s()
            file.write(_LINE)
            longest_s = max(longest_s, clock.now_s() - before_s)
    return DiskFacts(folder, speed_bytes_s, longest_s, shutil.disk_usage(folder).free)


def judge_disk(facts: DiskFacts) -> Finding:
    """Compare with what logging needs."""
    room_s = facts.free_bytes / LOG_BYTES_S
    text = (
        f"{facts.speed_bytes_s / 1e6:.0f} MB/s (a run's log needs {LOG_BYTES_S / 1e6:g}), "
        f"slowest line {facts.longest_write_s * 1e3:.2g} ms, {_size(facts.free_bytes)} free "
        f"at {facts.folder}"
    )
    values: dict[str, Value] = {
        "folder": str(facts.folder),
        "speed_bytes_s": facts.speed_bytes_s,
        "needed_bytes_s": LOG_BYTES_S,
        "longest_write_s": facts.longest_write_s,
        "free_bytes": facts.free_bytes,
    }
    if facts.speed_bytes_s < LOG_BYTES_S or room_s < 60.0:
        advice = "write runs to a faster disk with room: --out FOLDER"
        return Finding("disk", Status.FAIL, text, advice, values)
    if room_s < _LEAST_ROOM_S:
        return Finding("disk", Status.WARN, text, "make room: it lasts less than an hour", values)
    if facts.speed_bytes_s < _LEAST_MARGIN * LOG_BYTES_S or facts.longest_write_s > _STALL_S:
        advice = "write runs to a local disk that nothing else keeps busy: --out FOLDER"
        return Finding("disk", Status.WARN, text, advice, values)
    return Finding("disk", Status.OK, text, "", values)


def _size(count: int) -> str:
    return f"{count / 1e9:.0f} GB" if count >= 10e9 else f"{count / 1e6:.0f} MB"
