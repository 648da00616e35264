"""The newest picture as a ready-made part of the stream, handed to every client."""

import threading

import cv2
import numpy as np

from drivers.interfaces import Frame

BOUNDARY = "frame"


class Publisher:
    """Keeps one encoded part; a client that is slow skips what it missed."""

    def __init__(self, quality: int) -> None:
        self._quality = quality
        self._changed = threading.Condition()
        self._part = b""
        self._count = 0
        self._ended = False

    def publish(self, frame: Frame) -> None:
        """Encode and hand out a frame."""
        self._hand_out(encode_part(frame, self._quality))

    def repeat(self) -> None:
        """Hand out the last part again, stamp and all, as a hung camera server does."""
        self._hand_out(self._part)

    def end(self) -> None:
        """Send every waiting client away."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def next(self, seen: int) -> tuple[int, bytes] | None:
        """Wait for a part after number ``seen``; None when there will be none any more."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._count > seen)
            return None if self._ended else (self._count, self._part)

    def _hand_out(self, part: bytes) -> None:
        if not part:
            return
        with self._changed:
            self._part = part
            self._count += 1
            self._changed.notify_all()


def encode_part(frame: Frame, quality: int) -> bytes:
    """One part of the stream: header fields and the JPEG."""
    done, jpeg = cv2.imencode(".jpg", frame.image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise ValueError(f"cannot encode an image of shape {frame.image.shape}")
    body = np.asarray(jpeg).tobytes()
    head = (
        f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(body)}\r\n"
        f"X-Timestamp: {frame.t_exposure_mid_s:.9f}\r\nX-Sequence: {frame.seq}\r\n"
        f"X-Exposure: {frame.exposure_s:.9f}\r\n\r\n"
    )
    return head.encode("ascii") + body + b"\r\n"
