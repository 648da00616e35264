"""A made-up camera on the wall clock for the loopback server, and a settable server of bytes."""

import socket
import threading
from contextlib import suppress
from types import TracebackType
from typing import Self

import numpy as np

from drivers.clock import WallClock
from drivers.interfaces import Frame, GreyImage

PERIOD_S = 0.02
HEIGHT, WIDTH = 48, 64


def noisy(seq: int) -> GreyImage:
    """Smooth enough for JPEG, different for each number."""
    image = np.full((HEIGHT, WIDTH), 20 + (seq % 20) * 10, np.uint8)
    image[10:20, 10:20] += np.uint8(seq % 7)
    return image


class TickingCamera:
    """A frame every ``PERIOD_S``, at its instant."""

    def __init__(self) -> None:
        self.clock = WallClock()
        self._start_s = self.clock.now_s()
        self._seq = -1

    def read(self, timeout_s: float) -> Frame | None:
        due = int((self.clock.now_s() - self._start_s) / PERIOD_S)
        self._seq = max(self._seq + 1, due)
        t_s = self._start_s + self._seq * PERIOD_S
        self.clock.sleep_until(t_s)
        return Frame(noisy(self._seq), t_s, 0.004, self._seq, "sim")

    def seq_at(self, t_s: float) -> int:
        """Which picture was taken then."""
        return round((t_s - self._start_s) / PERIOD_S)


class ByteServer:
    """Answers one connection after another with the same bytes, then waits or hangs up."""

    def __init__(self, answer: bytes, then_hang_up: bool = False) -> None:
        self._answer = answer
        self._hang_up = then_hang_up
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._clients: list[socket.socket] = []
        self.requests: list[bytes] = []
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}/x"
        threading.Thread(target=self._work, daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._listener.close()
        for client in self._clients:
            client.close()

    def _work(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return  # closed by the test
            self._clients.append(client)
            with suppress(OSError):  # hung up by the client
                self.requests.append(client.recv(4096))
                client.sendall(self._answer)
                if self._hang_up:
                    client.shutdown(socket.SHUT_RDWR)
