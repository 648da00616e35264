"""Vision in a process of its own: control shares neither the interpreter nor its lock with it.

In a thread, measuring holds the interpreter for up to its switch interval of 5 ms at a time and
delays a control tick by as much; a process leaves the choice to the system's scheduler.
"""

import contextlib
import os
import signal
import socket
import subprocess
import tempfile
from typing import Protocol

from drivers.clock import Clock
from drivers.errors import ConnectError, DeviceTimeoutError, OperateError, RigError
from drivers.own_python import own_python
from rig.vision.images import ImageRing
from rig.vision.messages import (
    BEGIN,
    MOST_BYTES,
    Failed,
    Idle,
    Images,
    Job,
    Message,
    Ready,
    Seen,
    message_of,
)
from rig.vision.sighting import Sighting

# Longer than compiling every kernel takes on a slow machine that does other things too.
_READY_TIMEOUT_S = 900.0
_POLL_S = 0.02
# It reports ten times a second; the arm rests by then for want of fresh images.
_SILENCE_LIMIT_S = 1.5
_END_TIMEOUT_S = 3.0
_STATUS_TIMEOUT_S = 0.005
_SAID_BYTES = 600


class Feed(Protocol):
    """The motion of a simulated arm, which a camera simulated in the child follows."""

    file: int  # shared memory

    def publish(self) -> None:
        """Show what happened up to the present."""
        ...

    def close(self) -> None:
        """Let go of the file; harmless when repeated."""
        ...


class ProcessVision:
    """A running child that has the camera open; it measures from the first ``poll`` on.

    ``clock`` must be the machine's monotonic clock, which both processes see. Raises what the
    camera raises when it cannot be opened, ConnectError when the child does not get that far.
    """

    def __init__(self, job: Job, clock: Clock, feed: Feed | None = None) -> None:
        self._clock = clock
        self._feed = feed
        self._error: RigError | None = None
        self._problem: str | None = None
        self._ring: ImageRing | None = None
        self._begun = False
        self._heard_s = 0.0
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the child
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        files = [theirs.fileno()] + ([] if feed is None else [feed.file])
        try:
            self._process = subprocess.Popen(
                [*own_python("rig.vision.child"), *map(str, files)],
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=self._output,
                pass_fds=files,
                # Ctrl-C at the terminal is for the parent to handle.
                start_new_session=True,
            )
        finally:
            theirs.close()
            if feed is not None:
                feed.close()
        try:
            self._socket.send(job.to_bytes())
            self._socket.setblocking(False)
            self._wait_until_ready()
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """The child's process id."""
        return self._process.pid

    def poll(self) -> list[Sighting]:
        """Sightings since the last call; raises what the camera raised, and stays raised.

        Raises OperateError when the child died, DeviceTimeoutError when it hangs.
        """
        if self._error is None:
            try:
                return self._sightings()
            except RigError as error:
                self._error = error
        raise self._error

    def problem(self) -> str | None:
        """What the camera complained about when it last delivered nothing."""
        return self._problem

    def close(self) -> None:
        """Hang up, and make sure of the child's end; harmless when repeated."""
        self._socket.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_TIMEOUT_S)
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        self._output.close()

    def _sightings(self) -> list[Sighting]:
        now_s = self._clock.now_s()
        if not self._begun:
            self._begun, self._heard_s = True, now_s
            self._say(BEGIN)
        if self._feed is not None:
            self._feed.publish()
        out = []
        while (message := self._next()) is not None:
            self._heard_s = now_s
            if isinstance(message, Seen):
                self._problem = None
                image = None if self._ring is None else self._ring.get(message.number)
                if image is not None:  # else so late that newer images took its place
                    out.append(message.sighting(image))
            elif isinstance(message, Idle):
                self._problem = message.problem
        if now_s - self._heard_s > _SILENCE_LIMIT_S:
            raise DeviceTimeoutError(
                f"the process that reads the camera has been silent for "
                f"{now_s - self._heard_s:.1f} s: check the camera and the machine's load, then "
                "start again"
            )
        return out

    def _next(self) -> Message | None:
        """The next message, None when there is none now; raises what the child reports."""
        try:
            packet, files, _, _ = socket.recv_fds(self._socket, MOST_BYTES, 1)
        except BlockingIOError:
            return None
        except OSError:
            packet, files = b"", []
        if not packet:
            raise OperateError(self._died())
        message = message_of(packet)
        if isinstance(message, Failed):
            raise message.error()
        if isinstance(message, Images):
            self._ring = ImageRing(files[0], (message.height, message.width))
        for file in files:
            os.close(file)
        return message

    def _say(self, packet: bytes) -> None:
        try:
            self._socket.send(packet)
        except OSError as error:
            raise OperateError(self._died()) from error

    def _wait_until_ready(self) -> None:
        deadline_s = self._clock.now_s() + _READY_TIMEOUT_S
        while self._clock.now_s() < deadline_s:
            try:
                message = self._next()
            except OperateError as error:
                raise ConnectError(str(error)) from error
            if isinstance(message, Ready):
                return
            self._clock.sleep_until(self._clock.now_s() + _POLL_S)
        raise ConnectError(
            f"the process that reads the camera was not ready within {_READY_TIMEOUT_S:g} s: "
            f"{self._said()}"
        )

    def _died(self) -> str:
        """What is known about the child's end."""
        how = ""
        with contextlib.suppress(subprocess.TimeoutExpired, ValueError):
            status = self._process.wait(_STATUS_TIMEOUT_S)
            how = f" (exit status {status}): {self._said()}" if status >= 0 else ""
            how = how or f" ({signal.Signals(-status).name})"
        return f"the process that reads the camera and measures died{how}; start again"

    def _said(self) -> str:
        """The end of what the child printed."""
        self._output.seek(0, os.SEEK_END)
        self._output.seek(max(0, self._output.tell() - _SAID_BYTES))
        text = self._output.read().decode(errors="replace")
        return "; ".join(line.strip() for line in text.splitlines() if line.strip()) or "no output"
