"""The V4L2 system calls that OpenCV does not offer: what a node is, can do, and its controls.

Numbers and layouts are those of linux/videodev2.h, which the kernel keeps stable.
"""

import fcntl
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass

_QUERYCAP = 0x80685600
_ENUM_FMT = 0xC0405602
_ENUM_FRAMESIZES = 0xC02C564A
_ENUM_FRAMEINTERVALS = 0xC034564B
_QUERYCTRL = 0xC0445624
_G_CTRL = 0xC008561B
_S_CTRL = 0xC008561C

_CAP_CAPTURE = 0x00000001
_CAP_CAPTURE_MPLANE = 0x00001000
_CAP_DEVICE_CAPS = 0x80000000
_TYPE_CAPTURE = 1
_TYPE_CAPTURE_MPLANE = 9
_DISCRETE = 1
_MOST = 256  # no driver lists more; a broken one must not keep us for ever


@dataclass(frozen=True, slots=True)
class NodeInfo:
    """What a node says of itself."""

    driver: str
    card: str
    bus: str
    captures: bool
    multiplanar: bool


@dataclass(frozen=True, slots=True)
class ControlInfo:
    """A control's range; inactive: an automatic overrides it now."""

    name: str
    minimum: int
    maximum: int
    step: int
    inactive: bool
    read_only: bool


@dataclass(frozen=True, slots=True)
class OfferedMode:
    """One picture format, size and the rates it comes at."""

    fourcc: str
    width: int
    height: int
    rates_hz: tuple[float, ...]  # highest first; a range gives its two ends
    stepwise: bool  # the size is the largest of a range


def open_node(path: str) -> int:
    """A descriptor for questions and controls; does not disturb whoever streams."""
    return os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)


def query_node(fd: int) -> NodeInfo:
    """Who the node is; raises OSError when it is no V4L2 node."""
    answer = bytearray(104)
    fcntl.ioctl(fd, _QUERYCAP, answer)
    driver, card, bus, _, caps, device_caps = struct.unpack_from("<16s32s32sIII", answer)
    if caps & _CAP_DEVICE_CAPS:
        caps = device_caps
    multiplanar = bool(caps & _CAP_CAPTURE_MPLANE)
    captures = bool(caps & _CAP_CAPTURE) or multiplanar
    return NodeInfo(_text(driver), _text(card), _text(bus), captures, multiplanar)


def query_control(fd: int, control: int) -> ControlInfo | None:
    """A control's range; None where the device has no such control."""
    answer = bytearray(68)
    struct.pack_into("<I", answer, 0, control)
    try:
        fcntl.ioctl(fd, _QUERYCTRL, answer)
    except OSError:
        return None
    _, _, name, lowest, highest, step, _, flags = struct.unpack_from("<II32siiiiI", answer)
    if flags & 0x0001:  # disabled
        return None
    return ControlInfo(
        _text(name), lowest, highest, step, bool(flags & 0x0010), bool(flags & 0x0004)
    )


def get_control(fd: int, control: int) -> int:
    """A control's value; raises OSError."""
    answer = bytearray(struct.pack("<Ii", control, 0))
    fcntl.ioctl(fd, _G_CTRL, answer)
    return int(struct.unpack("<Ii", answer)[1])


def set_control(fd: int, control: int, value: int) -> None:
    """Ask for a value; the driver may round it. Raises OSError when it refuses."""
    fcntl.ioctl(fd, _S_CTRL, bytearray(struct.pack("<Ii", control, value)))


def offered_modes(fd: int, multiplanar: bool) -> Iterator[OfferedMode]:
    """Every mode of the node, as its driver lists them."""
    kind = _TYPE_CAPTURE_MPLANE if multiplanar else _TYPE_CAPTURE
    for index in range(_MOST):
        answer = bytearray(64)
        struct.pack_into("<II", answer, 0, index, kind)
        if not _next(fd, _ENUM_FMT, answer):
            return
        pixel_format = int(struct.unpack_from("<I", answer, 44)[0])
        yield from _modes_of(fd, pixel_format)


def _modes_of(fd: int, pixel_format: int) -> Iterator[OfferedMode]:
    fourcc = struct.pack("<I", pixel_format & 0x7FFFFFFF).decode("latin-1").rstrip()
    for index in range(_MOST):
        answer = bytearray(44)
        struct.pack_into("<II", answer, 0, index, pixel_format)
        if not _next(fd, _ENUM_FRAMESIZES, answer):
            return
        kind, *numbers = struct.unpack_from("<I6I", answer, 8)
        discrete = kind == _DISCRETE
        width, height = (numbers[0], numbers[1]) if discrete else (numbers[1], numbers[4])
        rates = _rates(fd, pixel_format, width, height)
        yield OfferedMode(fourcc, width, height, rates, not discrete)
        if not discrete:
            return


def _rates(fd: int, pixel_format: int, width: int, height: int) -> tuple[float, ...]:
    out: list[float] = []
    for index in range(_MOST):
        answer = bytearray(52)
        struct.pack_into("<IIII", answer, 0, index, pixel_format, width, height)
        if not _next(fd, _ENUM_FRAMEINTERVALS, answer):
            break
        kind, *numbers = struct.unpack_from("<I4I", answer, 16)
        intervals = [numbers[:2]] if kind == _DISCRETE else [numbers[:2], numbers[2:4]]
        out += [below / above for above, below in intervals if above]
        if kind != _DISCRETE:
            break
    return tuple(sorted(set(out), reverse=True))


def _next(fd: int, request: int, answer: bytearray) -> bool:
    try:
        fcntl.ioctl(fd, request, answer)
    except OSError:
        return False  # the end of the list, or a driver that does not list
    return True


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("utf-8", "replace")
