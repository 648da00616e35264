"""The process that serves the live page: the far end of ``LivePage``.

It ends when the run hangs up, which the system does for a run that dies, however it dies.
"""

import contextlib
import os
import signal
import socket
import sys

import cv2

from drivers.clock import Clock, WallClock
from rig.outlined import outlined
from rig.page.address import PageAddress
from rig.page.board import Board
from rig.page.messages import (
    MOST_BYTES,
    About,
    Failed,
    ImageShape,
    Served,
    message_of,
    to_bytes,
)
from rig.page.panel import Panel
from rig.page.scene import Scene
from rig.page.server import PageServer
from rig.page.state import PageState, state_of_bytes
from rig.vision.images import ImageRing

_EVERY_S = 1.0 / 30.0
# Browsers have to get the last state, and people to see it, before the connection goes.
_LINGER_S = 1.0


class Child:
    """Serves one run."""

    def __init__(self, parent: socket.socket, board: Board, server: PageServer) -> None:
        self._parent = parent
        self._board = board
        self._server = server
        self._about: About | None = None
        self._scene: Scene | None = None
        self._ring: ImageRing | None = None
        self._image: int | None = None
        self._panel = Panel(server.viser, board.request_stop)

    def run(self, clock: Clock) -> None:
        """Show state after state until the run hangs up."""
        next_s = clock.now_s()
        while self._listen():
            self._update()
            # A process that was held up begins anew instead of hurrying after.
            next_s = max(next_s + _EVERY_S, clock.now_s())
            clock.sleep_until(next_s)
        self._update()
        self._panel.end("the run has ended")
        self._server.viser.flush()
        clock.sleep_until(clock.now_s() + _LINGER_S)
        self._server.stop()

    def _listen(self) -> bool:
        """Take what the run says; False when it has hung up."""
        while True:
            try:
                packet, files, _, _ = socket.recv_fds(self._parent, MOST_BYTES, 1)
            except BlockingIOError:
                return True
            except OSError:
                return False
            if not packet:
                return False
            message = message_of(packet)
            if isinstance(message, About):
                self._about = message
                self._scene = Scene(self._server.viser, message.setup, message.safety)
            elif isinstance(message, ImageShape):
                self._ring = ImageRing(files[0], (message.height, message.width))
            for file in files:
                os.close(file)

    def _update(self) -> None:
        states = [state_of_bytes(message) for message in self._board.take()]
        if not states:
            return
        with self._server.viser.atomic():
            self._panel.update(states[-1])
            if self._scene is not None:
                self._scene.update(states[-1])
        self._show_image(states[-1])

    def _show_image(self, state: PageState) -> None:
        if state.image is None or state.image == self._image or self._ring is None:
            return
        image = self._ring.get(state.image)
        if image is None or self._about is None:
            return
        self._image = state.image
        drawn = outlined(image, state.feature, self._about.setup.intrinsics)
        caption = state.image_reason or "the fitted outline in red"
        self._panel.show_image(drawn, caption)


def serve(parent: socket.socket, board: Board) -> None:
    """Serve the page at the address that comes first."""
    address = message_of(parent.recv(MOST_BYTES))
    assert isinstance(address, PageAddress)
    try:
        server = PageServer(address)
    except OSError as error:
        parent.send(to_bytes(Failed(f"the page cannot be served at {address.host}: {error}")))
        return
    child = Child(parent, board, server)
    parent.send(to_bytes(Served(server.url)))
    parent.setblocking(False)
    child.run(WallClock())


def main() -> None:
    """Arguments: the parent's socket and the board's file."""
    # Ctrl-C at a terminal is the parent's to handle; it then ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Watching must not compete with controlling, whatever the program was started under.
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    with contextlib.suppress(OSError):
        os.nice(5)
    cv2.setNumThreads(1)
    parent = socket.socket(fileno=int(sys.argv[1]))
    file = int(sys.argv[2])
    board = Board(file)
    os.close(file)
    serve(parent, board)
    sys.stderr.flush()
    # Not through the interpreter's end, which waits for the server's threads.
    os._exit(0)
