"""The machine's video nodes: their stable names, what they are, and who holds them."""

import os
from dataclasses import dataclass
from pathlib import Path

from drivers.camera import v4l2_ioctl as v4l2

BY_ID = Path("/dev/v4l/by-id")
SYSFS = Path("/sys/class/video4linux")
DEV = Path("/dev")
PROC = Path("/proc")


@dataclass(frozen=True, slots=True)
class Holder:
    """A process that has a node open."""

    pid: int
    name: str

    def __str__(self) -> str:
        return f"process {self.pid} ({self.name})"


@dataclass(frozen=True, slots=True)
class VideoNode:
    """One /dev/videoN."""

    node: str
    name: str  # as the driver names it
    by_id: tuple[str, ...]  # stable names
    captures: bool | None  # None: could not be asked
    modes: tuple[v4l2.OfferedMode, ...]
    holders: tuple[Holder, ...]
    problem: str | None  # why it could not be asked


def list_nodes() -> list[VideoNode]:
    """Every video node of the machine, in the order of their numbers."""
    names = [path.name for path in SYSFS.iterdir()] if SYSFS.is_dir() else []
    numbered = [name for name in names if name.startswith("video")]
    return [_describe(DEV / name) for name in sorted(numbered, key=lambda n: (len(n), n))]


def resolve_node(address: str) -> str:
    """The node a by-id name points to now, which changes when the camera is replugged."""
    return os.path.realpath(address)


def holders_of(node: str) -> tuple[Holder, ...]:
    """Other processes that have ``node`` open, as far as this user may see."""
    node = resolve_node(node)
    out: list[Holder] = []
    for process in PROC.iterdir() if PROC.is_dir() else ():
        if not process.name.isdecimal() or int(process.name) == os.getpid():
            continue
        if _has_open(process, node):
            out.append(Holder(int(process.name), _command(process)))
    return tuple(sorted(out, key=lambda holder: holder.pid))


def why_not_opened(address: str) -> str:
    """In words, why the camera at ``address`` cannot be opened, and what to do."""
    node = resolve_node(address)
    if not os.path.exists(node):
        return f"there is no {address}: {_present()}"
    if not os.access(node, os.R_OK | os.W_OK):
        return (
            f"no permission for {node}: add yourself to its group, "
            '`sudo usermod -aG video "$USER"`, and log in again'
        )
    described = _describe(Path(node))
    if described.problem is not None:
        return f"{node} cannot be opened: {described.problem}"
    if described.captures is False:
        return f"{node} ({described.name}) delivers no pictures: {_present()}"
    if described.holders:
        who = ", ".join(str(holder) for holder in described.holders)
        return f"{node} ({described.name}) is in use by {who}: end it first"
    return f"{node} ({described.name}) cannot be opened: in use by another program, or unplugged"


def _present() -> str:
    cameras = [node for node in list_nodes() if node.captures]
    if not cameras:
        return "no camera is connected to this machine"
    return "cameras here: " + ", ".join((*node.by_id, node.node)[0] for node in cameras)


def _describe(path: Path) -> VideoNode:
    label = SYSFS / path.name / "name"
    name = label.read_text(encoding="utf-8", errors="replace").strip() if label.is_file() else ""
    captures: bool | None = None
    modes: tuple[v4l2.OfferedMode, ...] = ()
    problem: str | None = None
    try:
        fd = v4l2.open_node(str(path))
    except OSError as error:
        problem = error.strerror
    else:
        try:
            info = v4l2.query_node(fd)
            name, captures = name or info.card, info.captures
            modes = tuple(v4l2.offered_modes(fd, info.multiplanar)) if captures else ()
        except OSError as error:
            problem = error.strerror
        finally:
            os.close(fd)
    holders = holders_of(str(path))
    return VideoNode(str(path), name, _stable_names(path), captures, modes, holders, problem)


def _stable_names(node: Path) -> tuple[str, ...]:
    if not BY_ID.is_dir():
        return ()
    links = (link for link in BY_ID.iterdir() if os.path.realpath(link) == str(node))
    return tuple(sorted(str(link) for link in links))


def _has_open(process: Path, node: str) -> bool:
    try:
        return any(os.readlink(fd) == node for fd in (process / "fd").iterdir())
    except OSError:
        return False  # it ended meanwhile, or belongs to another user


def _command(process: Path) -> str:
    try:
        return (process / "comm").read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return "?"
