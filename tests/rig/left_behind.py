"""What a process leaves behind: other processes, shared memory."""

import os
from dataclasses import dataclass
from pathlib import Path

MARK = "ACTIVERIG_TEST_MARK"
_SHARED = Path("/dev/shm")


def processes_marked(mark: str) -> dict[int, str]:
    """Living processes (id to command line) that inherited ``mark`` in their environment."""
    wanted = f"{MARK}={mark}".encode()
    found = {}
    for entry in Path("/proc").iterdir():
        if not entry.name.isdecimal():
            continue
        try:
            marked = wanted in (entry / "environ").read_bytes().split(b"\0")
            command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            continue  # it has just ended, or belongs to somebody else
        if marked and command:  # one that only waits to be reaped has no command line
            found[int(entry.name)] = command
    return found


@dataclass(frozen=True, slots=True)
class SharedMemory:
    """The named shared memory of the machine at one instant."""

    names: frozenset[str]

    def new_and_unused(self) -> list[str]:
        """Names that appeared since, and that no living process has mapped or open."""
        fresh = _names() - self.names
        return sorted(name for name in fresh if not _in_use(str(_SHARED / name)))


def shared_memory() -> SharedMemory:
    """The names present now."""
    return SharedMemory(_names())


def _names() -> frozenset[str]:
    return frozenset(os.listdir(_SHARED)) if _SHARED.is_dir() else frozenset()


def _in_use(path: str) -> bool:
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                if path in (entry / "maps").read_text():
                    return True
                if any(os.readlink(file) == path for file in (entry / "fd").iterdir()):
                    return True
            except OSError:
                continue  # it has just ended, or belongs to somebody else
    return False
