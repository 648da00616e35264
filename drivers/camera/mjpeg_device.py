"""An MJPEG stream over HTTP as a live source, read part by part.

Read directly and not through FFmpeg, which hides the parts' header fields: a stamp in them
(X-Timestamp, seconds of CLOCK_MONOTONIC at mid-exposure, with X-Sequence and X-Exposure) is the
only way to know when a picture was taken. A server on another machine, or one that sends the
time of day, fails the check of the stamp, and its pictures are stamped on arrival.
"""

import base64
import http.client
import math
from collections import deque
from email.message import Message
from urllib.parse import SplitResult, unquote, urlsplit

from drivers.camera.device import CameraLost, Grab, Mode, NoControls
from drivers.camera.grey import jpeg_to_grey
from drivers.camera.multipart import MultipartParser, Part, StreamError
from drivers.clock import Clock
from drivers.errors import ConnectError

_CHUNK_BYTES = 256 * 1024


class MjpegDevice:
    """One connection; raises ConnectError when the server does not answer with such a stream."""

    stamp_source = "stream"
    stamps_mid_exposure = True

    def __init__(self, url: str, clock: Clock, timeout_s: float) -> None:
        self._url = url
        self._clock = clock
        self._timeout_s = timeout_s
        self.controls = NoControls()
        self._parts: deque[Part] = deque()
        self._first: Grab | None = None
        self._connection = _connection(urlsplit(url), timeout_s)
        try:
            self._response = self._request()
            self._parser = MultipartParser(_boundary(self._response.headers, url))
        except BaseException:
            self._connection.close()
            raise

    def set_mode(self, mode: Mode, buffers: int) -> Mode:
        """A server decides itself: the size is that of its first picture, the rate unknown."""
        try:
            self._first = self.grab()
        except CameraLost as error:
            raise ConnectError(f"{self._url}: {error}") from error
        image = self._first.image
        if image is None:
            raise ConnectError(f"{self._url}: its first picture is not a readable JPEG")
        return Mode(image.shape[1], image.shape[0], None, "MJPG")

    def grab(self) -> Grab:
        """The next picture in the stream."""
        if self._first is not None:
            first, self._first = self._first, None
            return first
        while not self._parts:
            self._receive()
        part = self._parts.popleft()
        returned_s = self._clock.now_s()
        headers = part.headers
        sequence = _number(headers.get("x-sequence"))
        return Grab(
            image=jpeg_to_grey(part.body),
            returned_s=returned_s,
            stamp_s=_number(headers.get("x-timestamp")),
            sequence=None if sequence is None else int(sequence),
            exposure_s=_number(headers.get("x-exposure")),
        )

    def release(self) -> None:
        """Close the connection."""
        self._response.close()
        self._connection.close()

    def _request(self) -> http.client.HTTPResponse:
        parts = urlsplit(self._url)
        path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        headers = {"Accept": "multipart/x-mixed-replace"}
        if parts.username is not None:
            secret = f"{unquote(parts.username)}:{unquote(parts.password or '')}"
            headers["Authorization"] = "Basic " + base64.b64encode(secret.encode()).decode()
        try:
            self._connection.request("GET", path, headers=headers)
            response = self._connection.getresponse()
        except (OSError, http.client.HTTPException, ValueError) as error:
            raise ConnectError(
                f"{self._url} does not answer: {error}. Check the address and the server"
            ) from error
        if response.status != http.client.OK:
            raise ConnectError(f"{self._url}: the server says {response.status} {response.reason}")
        return response

    def _receive(self) -> None:
        try:
            data = self._response.read1(_CHUNK_BYTES)
        except TimeoutError as error:
            raise CameraLost(f"stalled: no picture for {self._timeout_s:g} s") from error
        except (OSError, http.client.HTTPException, ValueError) as error:
            raise CameraLost(f"the connection broke: {error}") from error
        if not data:
            raise CameraLost("the server closed the stream")
        try:
            self._parts.extend(self._parser.feed(data))
        except StreamError as error:
            raise CameraLost(f"not a readable stream: {error}") from error


def _connection(parts: SplitResult, timeout_s: float) -> http.client.HTTPConnection:
    kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
    try:
        return kind(parts.hostname or "", parts.port, timeout=timeout_s)
    except (ValueError, http.client.InvalidURL) as error:
        raise ConnectError(f"{parts.geturl()} is no address: {error}") from error


def _boundary(headers: Message, url: str) -> str:
    boundary = headers.get_param("boundary")
    if headers.get_content_maintype() != "multipart" or not isinstance(boundary, str):
        raise ConnectError(
            f"{url} is no MJPEG stream but {headers.get_content_type()}: "
            "give the address of the stream itself, as the server's page shows it"
        )
    return boundary


def _number(text: str | None) -> float | None:
    """A header's number; None when it is absent or none."""
    try:
        value = float(text) if text is not None else math.nan
    except ValueError:
        return None
    return value if math.isfinite(value) else None
