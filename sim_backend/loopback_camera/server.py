"""Serves frames from a callable as an MJPEG stream on the loopback interface."""

import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Literal, Self

from drivers.errors import ConnectError, RigError
from drivers.interfaces import Frame
from sim_backend.loopback_camera.publisher import BOUNDARY, Publisher

Fault = Literal["camera_unplug", "camera_freeze", "camera_repeat"]

_READ_TIMEOUT_S = 0.1
_CLIENT_TIMEOUT_S = 2.0
_MOST_REQUEST_BYTES = 8192


class MjpegServer:
    """Streams what ``read`` delivers to any number of clients, with faults on demand.

    ``read(timeout_s)`` is a ``Camera.read``: it is called by one thread of the server. With
    ``port=0`` a free port is chosen. Raises ConnectError when the port is taken.
    """

    def __init__(
        self,
        read: Callable[[float], Frame | None],
        host: str = "127.0.0.1",
        port: int = 0,
        quality: int = 95,
    ) -> None:
        self._read = read
        self._host = host
        self._port = port
        self._publisher = Publisher(quality)
        self._fault: Fault | None = None
        self._closing = threading.Event()
        self._lock = threading.Lock()
        self._listener: socket.socket | None = None
        self._clients: set[socket.socket] = set()
        self.error: RigError | None = None  # what ``read`` raised; the stream has ended then
        self._listen()
        self._producer = threading.Thread(target=self._produce, name="mjpeg", daemon=True)
        self._producer.start()

    @property
    def url(self) -> str:
        """Where the stream is."""
        return f"http://{self._host}:{self._port}/stream.mjpg"

    def inject(self, fault: Fault) -> None:
        """Fail from now on until ``clear``.

        ``camera_unplug`` drops and refuses connections, ``camera_freeze`` sends nothing more,
        ``camera_repeat`` sends the last picture for ever.
        """
        with self._lock:
            self._fault = fault
        if fault == "camera_unplug":
            self._unplug()

    def clear(self) -> None:
        """Work again."""
        with self._lock:
            was, self._fault = self._fault, None
        if was == "camera_unplug" and not self._closing.is_set():
            self._listen()

    def close(self) -> None:
        """End the stream; harmless when repeated."""
        self._closing.set()
        self._publisher.end()
        self._unplug()
        self._producer.join(_READ_TIMEOUT_S + _CLIENT_TIMEOUT_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _listen(self) -> None:
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((self._host, self._port))
            listener.listen()
        except OSError as error:
            listener.close()
            raise ConnectError(
                f"the MJPEG server cannot listen on {self._host}:{self._port}: {error}"
            ) from error
        self._port = int(listener.getsockname()[1])  # a free one stays ours when plugged in again
        self._listener = listener
        threading.Thread(target=self._accept, args=(listener,), daemon=True).start()

    def _unplug(self) -> None:
        with self._lock:
            listener, self._listener = self._listener, None
            sockets = list(self._clients) + ([] if listener is None else [listener])
        for each in sockets:
            # Closing alone does not wake a thread that waits on the socket.
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    def _produce(self) -> None:
        try:
            while not self._closing.is_set():
                frame = self._read(_READ_TIMEOUT_S)
                if frame is None or self._fault in ("camera_freeze", "camera_unplug"):
                    continue
                if self._fault == "camera_repeat":
                    self._publisher.repeat()
                else:
                    self._publisher.publish(frame)
        except RigError as error:
            self.error = error
        finally:
            self._publisher.end()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return  # unplugged
            with self._lock:
                self._clients.add(client)
            threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        with suppress(OSError):
            client.settimeout(_CLIENT_TIMEOUT_S)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if _is_get(client):
                client.sendall(
                    b"HTTP/1.0 200 OK\r\nCache-Control: no-store\r\nContent-Type: "
                    b"multipart/x-mixed-replace; boundary=" + BOUNDARY.encode() + b"\r\n\r\n"
                )
                self._stream(client)
            else:
                client.sendall(b"HTTP/1.0 405 Method Not Allowed\r\n\r\n")
        with self._lock:
            self._clients.discard(client)
        client.close()

    def _stream(self, client: socket.socket) -> None:
        seen = 0
        while (following := self._publisher.next(seen)) is not None:
            seen, part = following
            client.sendall(part)


def _is_get(client: socket.socket) -> bool:
    request = b""
    while b"\r\n\r\n" not in request and len(request) < _MOST_REQUEST_BYTES:
        data = client.recv(1024)
        if not data:
            break
        request += data
    return request.startswith(b"GET ")
