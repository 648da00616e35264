"""The control loop's end of the live page: it writes, never waits, and reads one number."""

import contextlib
import os
import socket
import subprocess
import tempfile
from importlib.util import find_spec
from types import TracebackType
from typing import Self

from drivers.clock import Clock
from drivers.errors import ConfigError, ConnectError
from drivers.own_python import own_python
from rig.config_safety import SafetyConfig
from rig.outcome import LiveStatus
from rig.page.address import PageAddress
from rig.page.board import Board
from rig.page.messages import MOST_BYTES, About, Failed, ImageShape, Served, message_of, to_bytes
from rig.page.state import state_of
from rig.recorded.setup import RunSetup
from rig.vision.images import ImageRing
from rig.vision.sighting import Sighting

IMAGES_PER_S = 15.0
STATES_PER_S = 30.0
_READY_TIMEOUT_S = 60.0
_END_TIMEOUT_S = 3.0
_SAID_BYTES = 600


class LivePage:
    """A page served by a child process, from construction to ``close``; a ``View`` meanwhile.

    Raises ConfigError when viser is not installed or the address is taken, ConnectError when the
    page does not get that far. Afterwards nothing that happens to the child is noticed here.
    """

    def __init__(self, address: PageAddress, safety: SafetyConfig, clock: Clock) -> None:
        """``clock`` must run by itself: it paces what is written, whatever clock the run has."""
        if find_spec("viser") is None:
            raise ConfigError("the page needs the package viser: pip install 'activerig[view]'")
        self._safety = safety
        self._clock = clock
        self._ring: ImageRing | None = None
        self._image: int | None = None
        self._shown: Sighting | None = None
        self._first_chi: float | None = None
        self._state = ""
        self._next_state_s = self._next_image_s = float("-inf")
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the child
        self._board, board_file = Board.create()
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        files = (theirs.fileno(), board_file)
        try:
            self._process = subprocess.Popen(
                [*own_python("rig.page.child"), *map(str, files)],
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=self._output,
                pass_fds=files,
                # Ctrl-C at the terminal is for the parent to handle.
                start_new_session=True,
            )
        finally:
            theirs.close()
            os.close(board_file)
        try:
            self._socket.send(to_bytes(address))
            self.url = self._wait_until_served()
        except BaseException:
            self.close()
            raise
        self._socket.setblocking(False)

    @property
    def pid(self) -> int:
        """The child's process id."""
        return self._process.pid

    def stop_requested(self) -> bool:
        """Whether somebody pressed STOP; costs less than a microsecond."""
        return self._board.stop_requests > 0

    def begin(self, setup: RunSetup) -> None:
        """Tell the page which run it shows."""
        self._tell(to_bytes(About(setup, self._safety, stoppable=True)))

    def show(self, status: LiveStatus) -> None:
        """Write the state, as often as a page can use, and every change of the run's state."""
        now_s = self._clock.now_s()
        if self._first_chi is None and status.estimate is not None:
            self._first_chi = status.estimate.chi
        if now_s < self._next_state_s and status.state == self._state:
            return
        self._next_state_s, self._state = now_s + 1.0 / STATES_PER_S, status.state
        if status.sighting is not None and now_s >= self._next_image_s:
            self._put_image(status.sighting, now_s)
        self._board.post(state_of(status, self._shown, self._first_chi, self._image).to_bytes())

    def close(self) -> None:
        """Hang up, and make sure of the child's end; harmless when repeated."""
        self._socket.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_TIMEOUT_S)
        if self._process.poll() is None:
            self._process.kill()  # also where it was stopped
            self._process.wait()
        self._output.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Nothing: the page stays until ``close``, with the end of the run on it."""

    def _put_image(self, sighting: Sighting, now_s: float) -> None:
        if sighting is self._shown:
            return
        image = sighting.frame.image
        shape = (image.shape[0], image.shape[1])
        if self._ring is None or self._ring.shape != shape:
            self._ring, file = ImageRing.create(shape)
            self._tell(to_bytes(ImageShape(*shape)), file)
            os.close(file)
        self._image, self._shown = self._ring.put(image), sighting
        self._next_image_s = now_s + 1.0 / IMAGES_PER_S

    def _tell(self, packet: bytes, file: int | None = None) -> None:
        # A page that is gone or takes nothing is no concern of the run.
        with contextlib.suppress(OSError):
            socket.send_fds(self._socket, [packet], [] if file is None else [file])

    def _wait_until_served(self) -> str:
        self._socket.settimeout(_READY_TIMEOUT_S)
        try:
            packet = self._socket.recv(MOST_BYTES)
        except TimeoutError as error:
            raise ConnectError(
                f"the page was not served within {_READY_TIMEOUT_S:g} s: {self._said()}"
            ) from error
        if not packet:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(_END_TIMEOUT_S)
            raise ConnectError(f"the process that serves the page died: {self._said()}")
        message = message_of(packet)
        if isinstance(message, Failed):
            raise ConfigError(message.reason)
        assert isinstance(message, Served)
        return message.url

    def _said(self) -> str:
        """The end of what the child printed."""
        self._output.seek(0, os.SEEK_END)
        self._output.seek(max(0, self._output.tell() - _SAID_BYTES))
        text = self._output.read().decode(errors="replace")
        return "; ".join(line.strip() for line in text.splitlines() if line.strip()) or "no output"
