"""The device nodes of cameras and serial ports, as /dev and /sys show them."""

import grp
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rig.doctor.system import read_text

Kind = Literal["video4linux", "tty"]

_NAMES: dict[Kind, str] = {"video4linux": r"video(\d+)", "tty": r"tty(?:USB|ACM)(\d+)"}
_STABLE: dict[Kind, str] = {"video4linux": "v4l/by-id", "tty": "serial/by-id"}


@dataclass(frozen=True, slots=True)
class UsbIdentity:
    """What a USB device says it is; ``serial`` is empty where it has none."""

    vendor: str  # four hexadecimal digits
    product: str
    serial: str
    port: str  # the socket, as the kernel names it: 1-1.2
    name: str  # in words
    interface: str  # of the device's several: two hexadecimal digits, empty where unknown


@dataclass(frozen=True, slots=True)
class DeviceNode:
    """One node below /dev."""

    path: str  # on the machine, without the root
    kind: Kind
    group: str
    mode: int  # permission bits
    accessible: bool  # this process may read and write it
    stable_names: tuple[str, ...]
    index: int  # of the camera's nodes: 0 is the one that captures
    usb: UsbIdentity | None
    latency_timer_ms: int | None  # FTDI adapters hold bytes back this long


def may_use(path: Path) -> bool:
    """Whether this process may read and write a node."""
    return os.access(path, os.R_OK | os.W_OK)


def find_nodes(
    kind: Kind, root: Path = Path("/"), accessible: Callable[[Path], bool] = may_use
) -> list[DeviceNode]:
    """The nodes of one kind, by number; those that vanish meanwhile are left out."""
    pattern = re.compile(_NAMES[kind])
    dev = root / "dev"
    names = [path.name for path in dev.iterdir()] if dev.is_dir() else []
    found = sorted((int(m[1]), name) for name in names if (m := pattern.fullmatch(name)))
    out = []
    for _, name in found:
        try:
            out.append(_describe(kind, name, root, accessible))
        except OSError:
            continue
    return out


def _describe(kind: Kind, name: str, root: Path, accessible: Callable[[Path], bool]) -> DeviceNode:
    path = root / "dev" / name
    status = path.stat()
    in_sysfs = root / "sys/class" / kind / name
    index, timer = (read_text(in_sysfs / part) for part in ("index", "device/latency_timer"))
    return DeviceNode(
        path=f"/dev/{name}",
        kind=kind,
        group=_group(status.st_gid),
        mode=status.st_mode & 0o777,
        accessible=accessible(path),
        stable_names=_stable_names(root / "dev" / _STABLE[kind], path, root),
        index=int(index) if index.isdecimal() else 0,
        usb=_usb(in_sysfs),
        latency_timer_ms=int(timer) if timer.isdecimal() else None,
    )


def _group(gid: int) -> str:
    try:
        return grp.getgrgid(gid).gr_name
    except KeyError:  # a number without a name, as in containers
        return str(gid)


def _stable_names(folder: Path, node: Path, root: Path) -> tuple[str, ...]:
    if not folder.is_dir():
        return ()
    real = os.path.realpath(node)
    links = (link for link in folder.iterdir() if os.path.realpath(link) == real)
    return tuple(sorted(f"/{link.relative_to(root)}" for link in links))


def _usb(in_sysfs: Path) -> UsbIdentity | None:
    """The USB device above a node; None for others."""
    device = Path(os.path.realpath(in_sysfs))
    interface = ""
    for above in device.parents:
        interface = interface or read_text(above / "bInterfaceNumber")
        vendor = read_text(above / "idVendor")
        if vendor:
            product, serial, name = (
                read_text(above / part) for part in ("idProduct", "serial", "product")
            )
            return UsbIdentity(vendor, product, serial, above.name, name, interface)
    return None
