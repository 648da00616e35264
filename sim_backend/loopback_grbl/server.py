"""The emulated controller on a pty, in real time, in a thread of its own."""

import contextlib
import os
import pty
import select
import threading
import tty
from pathlib import Path
from typing import Self

import numpy as np

from drivers.clock import Clock, WallClock
from sim_backend.history import JointHistory
from sim_backend.loopback_grbl import faults
from sim_backend.loopback_grbl.firmware import Firmware
from sim_backend.loopback_grbl.machine import FloatArray, Machine

_LOOK_S = 0.001
_READ_BYTES = 4096  # as much as a kernel holds for a slow line


class LoopbackGantry:
    """A serial port with a gantry behind it; ``port`` is what a client opens.

    ``start`` (axes,) is the machine position at power-up; ``link`` a file name to be made a
    link to the pty, so that configurations can name it. Opening the port prints nothing.
    Faults: those of ``faults`` and ``drop``, which closes the pty under the client; clearing
    it makes a new one. Nothing watches the client: what it queued runs on when it dies.
    """

    def __init__(
        self,
        machine: Machine,
        start: FloatArray,
        link: Path | None = None,
        clock: Clock | None = None,
        locked: bool = False,
    ) -> None:
        self.clock: Clock = WallClock() if clock is None else clock
        self.firmware = Firmware(machine, start, self.clock.now_s(), locked)
        self._link = link
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._master: int | None = None
        self._slave: int | None = None
        self.port = ""
        self._plug_in()
        self._thread = threading.Thread(target=self._serve, name="loopback-grbl", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def inject(self, name: str) -> None:
        """Begin a fault: a name of ``faults`` or ``drop``; raises KeyError for another."""
        with self._lock:
            self.firmware.advance_to(self.clock.now_s())
            if name == "drop":
                self._pull_out()
            else:
                faults.inject(self.firmware, name)

    def clear(self, name: str) -> None:
        """End a fault's cause; after ``drop`` a client has to open the port again."""
        with self._lock:
            self.firmware.advance_to(self.clock.now_s())
            if name != "drop":
                faults.clear(self.firmware, name)
            elif self._master is None:
                self._plug_in()

    @property
    def history(self) -> JointHistory:
        """True joint positions, a millisecond apart on the clock; ``sync`` brings it up to now."""
        return self.firmware.history

    def motion(self, since_s: float) -> FloatArray:
        """Rows (t_s, q (6), qd (6)) of the true motion from ``since_s`` to now."""
        self.sync()
        with self._lock:
            history = self.firmware.history
            first = int(np.ceil((since_s - history.start_s) / history.step_s))
            numbers = np.arange(max(first, history.first), history.count)
            q, qd = history.entries(numbers)
        return np.column_stack([history.start_s + numbers * history.step_s, q, qd])

    def joints(self) -> tuple[FloatArray, FloatArray]:
        """True joint positions and velocities (6,) each, now."""
        with self._lock:
            self.firmware.advance_to(self.clock.now_s())
            q, qd = self.firmware.joints()
        return q[0], qd[0]

    def sync(self) -> float:
        """Let the controller catch up with the clock, whose reading is returned."""
        with self._lock:
            now_s = self.clock.now_s()
            self.firmware.advance_to(now_s)
        return now_s

    def close(self) -> None:
        """End the emulation and remove the port; harmless when repeated."""
        self._stopping.set()
        self._thread.join(timeout=2.0)
        with self._lock:
            self._pull_out()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            master = self._master
            if master is None:
                self.clock.sleep_until(self.clock.now_s() + _LOOK_S)
            else:
                with contextlib.suppress(OSError, ValueError):  # pulled out meanwhile
                    select.select([master], [], [], _LOOK_S)
            with self._lock:
                self._exchange()

    def _exchange(self) -> None:
        now_s = self.clock.now_s()
        firmware = self.firmware
        firmware.advance_to(now_s)
        master = self._master
        if master is None:
            return
        with contextlib.suppress(BlockingIOError):
            firmware.receive(os.read(master, _READ_BYTES), now_s)
        out = firmware.send(now_s)
        if out:
            # A client that does not read loses what the kernel cannot hold, as on a real line.
            with contextlib.suppress(BlockingIOError):
                os.write(master, out)

    def _plug_in(self) -> None:
        master, slave = pty.openpty()
        # Raw from the start; and keeping the slave open here, the pty outlives its clients.
        tty.setraw(slave)
        os.set_blocking(master, False)
        self._master, self._slave = master, slave
        self.port = os.ttyname(slave)
        if self._link is not None:
            self._link.unlink(missing_ok=True)
            self._link.symlink_to(self.port)
            self.port = str(self._link)

    def _pull_out(self) -> None:
        for fd in (self._master, self._slave):
            if fd is not None:
                os.close(fd)
        self._master = self._slave = None
        self.firmware.clear_wires()
        if self._link is not None:
            self._link.unlink(missing_ok=True)
