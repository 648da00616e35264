"""What the grab loop needs from a live source: small enough to be faked in a test."""

from dataclasses import dataclass
from typing import Literal, Protocol

from drivers.errors import OperateError
from drivers.interfaces import GreyImage


class CameraLost(OperateError):
    """The source delivers no more; it must be opened again. The message says why."""


@dataclass(frozen=True, slots=True)
class Mode:
    """What is requested of a source, or what it really does; None: not requested, not known."""

    width: int | None = None
    height: int | None = None
    rate_hz: float | None = None
    fourcc: str | None = None


@dataclass(frozen=True, slots=True)
class Grab:
    """One exposure as the source delivered it."""

    image: GreyImage | None  # None: the buffer was marked bad or could not be decoded
    returned_s: float  # when the source handed it over, on the rig's clock
    stamp_s: float | None = None  # the source's own stamp on CLOCK_MONOTONIC
    sequence: int | None = None  # the source's own count of exposures
    exposure_s: float | None = None


ControlName = Literal[
    "auto_exposure",  # menu: 1 manual, 3 aperture priority
    "exposure",  # 100 µs
    "auto_gain",
    "gain",
    "auto_focus",
    "focus",
    "auto_white_balance",
    "white_balance",  # K
    "power_line",  # menu: 0 off, 1 50 Hz, 2 60 Hz, 3 auto
]


class ControlPort(Protocol):
    """The controls of a device, in V4L2's own units."""

    def read(self, name: ControlName) -> int | None:
        """The control's present value; None where the device has no such control."""
        ...

    def write(self, name: ControlName, value: int) -> str | None:
        """Ask for ``value``; None when the device took it, else its refusal in words."""
        ...


class VideoDevice(Protocol):
    """An open live source."""

    stamp_source: str  # what its stamps are called in a frame: "kernel" or "stream"
    stamps_mid_exposure: bool  # else they mark the arrival after exposure and transfer

    @property
    def controls(self) -> ControlPort:
        """The device's controls."""
        ...

    def set_mode(self, mode: Mode, buffers: int) -> Mode:
        """Request ``mode`` before the first grab; returns what the source really does."""
        ...

    def grab(self) -> Grab:
        """Wait for the next exposure; raises CameraLost when none comes in time."""
        ...

    def release(self) -> None:
        """Let go of the source; harmless when repeated."""
        ...


class NoControls:
    """The controls of a source that has none."""

    def read(self, name: ControlName) -> int | None:
        """No control exists."""
        return None

    def write(self, name: ControlName, value: int) -> str | None:
        """Always refused."""
        return "this kind of source has no controls"
