"""OpenCV's VideoCapture as a live source: V4L2 nodes, and streams through FFmpeg."""

import os

import numpy as np

from drivers.camera.device import CameraLost, ControlPort, Grab, Mode, NoControls
from drivers.camera.grey import RAW_FORMATS, raw_to_grey
from drivers.camera.source import Source, SourceKind
from drivers.camera.v4l2_controls import V4l2Controls
from drivers.camera.v4l2_nodes import resolve_node, why_not_opened
from drivers.clock import Clock
from drivers.errors import ConnectError
from drivers.interfaces import GreyImage

_TIMEOUT_VARIABLE = "OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT"
_STREAM_OPEN_TIMEOUT_MS = 5000


class OpenCvDevice:
    """One opening of a source; raises ConnectError, in words, when it cannot be opened."""

    stamp_source = "kernel"
    stamps_mid_exposure = False

    def __init__(self, source: Source, clock: Clock, timeout_s: int) -> None:
        # OpenCV would block for ten seconds on a stalled camera; it reads this when it opens.
        os.environ[_TIMEOUT_VARIABLE] = str(timeout_s)
        import cv2

        self._cv2 = cv2
        self._clock = clock
        self._timeout_s = timeout_s
        self._is_node = source.kind is SourceKind.DEVICE
        self._fourcc: str | None = None
        self._size = (0, 0)
        self._raw = False
        self.controls: ControlPort = NoControls()
        if self._is_node:
            node = resolve_node(source.address)
            if not os.path.exists(node):
                raise ConnectError(why_not_opened(source.address))
            self._capture = cv2.VideoCapture(node, cv2.CAP_V4L2)
        else:
            node = source.address
            self._capture = cv2.VideoCapture(
                node,
                cv2.CAP_FFMPEG,
                [
                    cv2.CAP_PROP_OPEN_TIMEOUT_MSEC,
                    _STREAM_OPEN_TIMEOUT_MS,
                    cv2.CAP_PROP_READ_TIMEOUT_MSEC,
                    1000 * timeout_s,
                ],
            )
        if not self._capture.isOpened():
            self._capture.release()
            if self._is_node:
                raise ConnectError(why_not_opened(source.address))
            raise ConnectError(f"the stream {node} cannot be opened: check address and server")
        if self._is_node:
            try:
                self.controls = V4l2Controls(node)
            except ConnectError:
                self._capture.release()
                raise

    def set_mode(self, mode: Mode, buffers: int) -> Mode:
        """Request ``mode`` in the order in which V4L2 drivers take it."""
        if self._is_node:
            self._request(mode, buffers)
        cv2, capture = self._cv2, self._capture
        fourcc = _fourcc_name(int(capture.get(cv2.CAP_PROP_FOURCC))) if self._is_node else None
        width = int(capture.get(cv2.CAP_PROP_FRAME_WIDTH))
        height = int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
        rate_hz = capture.get(cv2.CAP_PROP_FPS)
        self._fourcc, self._size = fourcc, (width, height)
        # A stream's announced rate is a guess of FFmpeg's; the measured one counts.
        return Mode(width, height, rate_hz if self._is_node and rate_hz > 0 else None, fourcc)

    def grab(self) -> Grab:
        """Wait for the next exposure; a stall and a vanished device are told apart by time."""
        cv2, capture = self._cv2, self._capture
        began_s = self._clock.now_s()
        grabbed = capture.grab()
        returned_s = self._clock.now_s()
        if not grabbed:
            if returned_s - began_s >= 0.9 * self._timeout_s:
                raise CameraLost(f"stalled: no frame for {returned_s - began_s:.1f} s")
            raise CameraLost("unplugged, or its driver failed: it refuses to deliver")
        # Only right after grab() is this the stamp of the frame just taken.
        stamp_ms = capture.get(cv2.CAP_PROP_POS_MSEC) if self._is_node else 0.0
        decoded, picture = capture.retrieve()
        image = self._grey(np.asarray(picture)) if decoded and picture is not None else None
        return Grab(image, returned_s, stamp_ms / 1e3 if stamp_ms > 0 else None)

    def release(self) -> None:
        """Close the source."""
        if isinstance(self.controls, V4l2Controls):
            self.controls.close()
        self._capture.release()

    def _request(self, mode: Mode, buffers: int) -> None:
        cv2, capture = self._cv2, self._capture
        if mode.fourcc is not None:
            capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*mode.fourcc))
        if mode.width is not None and mode.height is not None:
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, mode.width)
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, mode.height)  # only now the width acts
        if mode.rate_hz is not None:
            capture.set(cv2.CAP_PROP_FPS, mode.rate_hz)
        capture.set(cv2.CAP_PROP_BUFFERSIZE, buffers)
        fourcc = _fourcc_name(int(capture.get(cv2.CAP_PROP_FOURCC)))
        self._raw = fourcc in RAW_FORMATS
        capture.set(cv2.CAP_PROP_CONVERT_RGB, 0 if self._raw else 1)

    def _grey(self, picture: GreyImage) -> GreyImage | None:
        if self._raw and self._fourcc is not None:
            return raw_to_grey(picture, self._fourcc, *self._size)
        if picture.ndim == 2:
            return picture
        return np.asarray(self._cv2.cvtColor(picture, self._cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _fourcc_name(code: int) -> str | None:
    name = "".join(chr((code >> shift) & 0xFF) for shift in (0, 8, 16, 24))
    return name if name.isprintable() and name.strip() else None
