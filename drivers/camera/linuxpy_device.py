"""linuxpy as a live source: like OpenCV on a V4L2 node, with sequence numbers and error flags.

Optional: with linuxpy installed a dropped frame is counted and not guessed from a gap, and a
buffer that the driver marked as damaged is refused, which OpenCV would pass on as an image.
"""

import select
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Literal

import numpy as np

from drivers.camera.device import CameraLost, Grab, Mode
from drivers.camera.grey import RAW_FORMATS, raw_to_grey
from drivers.camera.v4l2_controls import V4l2Controls
from drivers.camera.v4l2_nodes import resolve_node, why_not_opened
from drivers.clock import Clock
from drivers.errors import ConnectError

_FLAG_ERROR = 0x0040
_FLAG_MONOTONIC = 0x2000
_TIMESTAMP_MASK = 0xE000


def linuxpy_wanted(access: Literal["auto", "opencv", "linuxpy"]) -> bool:
    """Whether to use linuxpy; raises ConnectError when it is demanded and missing."""
    installed = find_spec("linuxpy") is not None
    if access == "linuxpy" and not installed:
        raise ConnectError(
            "access: linuxpy needs the package linuxpy: pip install 'activerig[v4l2]'"
        )
    return installed and access != "opencv"


class LinuxpyDevice:
    """One opening of a V4L2 node; raises ConnectError, in words, when it cannot be opened."""

    stamp_source = "kernel"
    stamps_mid_exposure = False

    def __init__(self, address: str, clock: Clock, timeout_s: int) -> None:
        # Its types come and go between versions; everything it returns is checked here.
        video: Any = import_module("linuxpy.video.device")
        self._video = video
        self._address = address
        self._clock = clock
        self._timeout_s = timeout_s
        self._capture: Any = None
        self._format = ("", 0, 0)
        node = resolve_node(address)
        self._device = video.Device(node)
        try:
            self._device.open()
        except OSError as error:
            raise ConnectError(why_not_opened(address)) from error
        try:
            self.controls = V4l2Controls(node)
        except ConnectError:
            self._device.close()
            raise

    def set_mode(self, mode: Mode, buffers: int) -> Mode:
        """Request ``mode``, start streaming, and return what the node really does."""
        video, device = self._video, self._device
        kind = video.BufferType.VIDEO_CAPTURE
        try:
            now = device.get_format(kind)
            self._request(mode, _fourcc(now.pixel_format), now.width, now.height)
            got = device.get_format(kind)
            rate_hz = self._rate_hz()
            self._capture = video.VideoCapture(device, size=buffers)
            self._capture.open()
        except (OSError, video.V4L2Error) as error:
            raise ConnectError(f"{why_not_opened(self._address)} ({error})") from error
        fourcc = _fourcc(got.pixel_format)
        if fourcc not in RAW_FORMATS:
            raise ConnectError(
                f"camera {self._address} sends {fourcc}: ask for one of {', '.join(RAW_FORMATS)}, "
                "or set access: opencv"
            )
        self._format = (fourcc, int(got.width), int(got.height))
        return Mode(int(got.width), int(got.height), rate_hz, fourcc)

    def grab(self) -> Grab:
        """Wait for the next buffer, however damaged."""
        try:
            ready, _, _ = select.select([self._device.fileno()], [], [], self._timeout_s)
            returned_s = self._clock.now_s()
            if not ready:
                raise CameraLost(f"stalled: no frame for {self._timeout_s} s")
            frame = self._capture.buffer.raw_read()
        except (OSError, ValueError) as error:
            raise CameraLost(f"unplugged, or its driver failed: {error}") from error
        flags = int(frame.buff.flags)
        monotonic = flags & _TIMESTAMP_MASK == _FLAG_MONOTONIC
        image = None
        if not flags & _FLAG_ERROR:
            fourcc, width, height = self._format
            image = raw_to_grey(np.frombuffer(frame.data, np.uint8), fourcc, width, height)
        stamp_s = float(frame.timestamp) if monotonic else None
        return Grab(image, returned_s, stamp_s, int(frame.frame_nb))

    def release(self) -> None:
        """Stop streaming and close; a device that is gone refuses both, which is no matter."""
        capture, self._capture = self._capture, None
        if capture is not None:
            source = capture.buffer
            with suppress(OSError, ValueError):
                capture.close()
            # After a refusal linuxpy leaves its buffers mapped, and they hold the dead device:
            # it could not come back under its name.
            for mapped in (None if source is None else source.buffers) or ():
                mapped.close()
        self.controls.close()
        with suppress(OSError, ValueError):
            self._device.close()

    def _request(self, mode: Mode, fourcc: str, width: int, height: int) -> None:
        device, kind = self._device, self._video.BufferType.VIDEO_CAPTURE
        if (mode.fourcc, mode.width, mode.height) != (None, None, None):
            device.set_format(
                kind, mode.width or width, mode.height or height, mode.fourcc or fourcc
            )
        if mode.rate_hz is not None:
            with suppress(OSError):  # a node without rates: the measured one counts
                device.set_fps(kind, mode.rate_hz)

    def _rate_hz(self) -> float | None:
        try:
            return float(self._device.get_fps(self._video.BufferType.VIDEO_CAPTURE))
        except (OSError, ZeroDivisionError):
            return None


def _fourcc(pixel_format: object) -> str:
    """The four letters of what linuxpy may give as an enumeration or as a number."""
    code = int(pixel_format)  # type: ignore[call-overload]
    return "".join(chr((code >> shift) & 0x7F) for shift in (0, 8, 16, 24))
