"""The parent's end of the child process: start it, talk to it, notice its death, end it."""

import contextlib
import os
import signal
import socket
import subprocess
import tempfile

from drivers.clock import Clock
from drivers.errors import ConnectError
from drivers.own_python import own_python
from drivers.ur.faults import ArmProcessError
from drivers.ur.messages import MOST_BYTES, Command, Event, event_of
from drivers.ur.ring import SampleRing, make_ring_file
from drivers.ur.settings import UrSettings

_POLL_S = 0.02
_CLOSE_TIMEOUT_S = 6.0
_SAID_BYTES = 600


class ChildLink:
    """A running child whose control program runs on the controller.

    Raises ConnectError, with what the child said, when it does not get that far.
    """

    def __init__(self, settings: UrSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the child
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ring_file = make_ring_file()
        self.ring = SampleRing(ring_file)
        # A rig's configuration may carry keys of its own beside the driver's.
        own = settings.model_dump_json(include=set(UrSettings.model_fields))
        arguments = [str(theirs.fileno()), str(ring_file), own]
        try:
            self._process = subprocess.Popen(
                [*own_python("drivers.ur.child"), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=self._output,
                pass_fds=(theirs.fileno(), ring_file),
                # Ctrl-C at the terminal is for the parent to handle; it then tells the child.
                start_new_session=True,
            )
        finally:
            theirs.close()
            os.close(ring_file)
        self._socket.setblocking(False)
        try:
            self.ready = self._wait_until_ready()
        except BaseException:
            self.kill()
            raise

    @property
    def pid(self) -> int:
        """The child's process id."""
        return self._process.pid

    def send(self, command: Command) -> None:
        """Hand over an order; raises ArmProcessError when the child does not take it."""
        try:
            self._socket.send(command.to_bytes())
        except BlockingIOError as error:
            raise ArmProcessError(
                f"the process that talks to the arm at {self._settings.host} hangs"
            ) from error
        except OSError as error:
            raise ArmProcessError(self.death() or self._died("")) from error

    def events(self) -> list[Event]:
        """What the child reported since the last call."""
        out = []
        with contextlib.suppress(OSError):
            while packet := self._socket.recv(MOST_BYTES):
                out.append(event_of(packet))
        return out

    def death(self) -> str | None:
        """How the child died, None while it lives."""
        status = self._process.poll()
        if status is None:
            return None
        with contextlib.suppress(ValueError):
            return self._died(f" ({signal.Signals(-status).name})")
        return self._died(f" (exit status {status}): {self._said()}")

    def close(self, order: Command) -> None:
        """Give the last order, wait for the child's end, and make sure of it."""
        with contextlib.suppress(OSError):
            self._socket.send(order.to_bytes())
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_CLOSE_TIMEOUT_S)
        self.kill()

    def kill(self) -> None:
        """End the child at once; the controller's watchdog then stops the arm."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        self._socket.close()
        self._output.close()

    def _wait_until_ready(self) -> Event:
        deadline_s = self._clock.now_s() + self._settings.connect_timeout_s
        while self._clock.now_s() < deadline_s:
            for event in self.events():
                if event.kind == "ready":
                    return event
                raise ConnectError(event.text)
            if death := self.death():
                raise ConnectError(death)
            self._clock.sleep_until(self._clock.now_s() + _POLL_S)
        raise ConnectError(
            f"the arm at {self._settings.host} was not ready within "
            f"{self._settings.connect_timeout_s:g} s: {self._said()}"
        )

    def _died(self, how: str) -> str:
        return (
            f"the process that talks to the arm at {self._settings.host} died{how}; the "
            "controller's watchdog stops the arm. Run `rig arm recover`, then start again"
        )

    def _said(self) -> str:
        """The end of what the child and the vendor's code printed."""
        if self._output.closed:
            return "no output"
        self._output.seek(0, os.SEEK_END)
        self._output.seek(max(0, self._output.tell() - _SAID_BYTES))
        text = self._output.read().decode(errors="replace")
        return "; ".join(line.strip() for line in text.splitlines() if line.strip()) or "no output"
