"""A thread that writes the log, so that neither disk nor compression holds up the loop.

On the wall clock handing over never waits: when the disk is slow, images are dropped first and
counted, everything else only when minutes of it wait. On simulated time nobody is in a hurry and
the hand-over waits, so that the same run gives the same file.
"""

import struct
import sys
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from mcap.exceptions import McapError

from drivers.clock import Clock
from rig.log.encode import Encoder
from rig.log.entry import Attached, Entry, Happened, Picture
from rig.log.mcap_file import McapFile
from rig.realtime import step_back

_EVERY_S = 0.05
# Well below the second after which everything has to be readable.
_FLUSH_AFTER_S = 0.4
_EVENT_AFTER_S = 0.05  # an event is worth a chunk of its own, a shower of them is not
_MOST_IMAGE_BYTES = 48 << 20  # five seconds of 640x480 at 30 Hz
_MOST_ENTRIES = 100_000  # minutes
# Simulated time: a moment's work for the thread.
_AHEAD_IMAGE_BYTES = 16 << 20
_AHEAD_ENTRIES = 5_000
_ROOM_S = 0.002
_CLOSE_TIMEOUT_S = 20.0


@dataclass(frozen=True, slots=True)
class Recorded:
    """What became of a recording."""

    size_bytes: int
    images: int  # handed to the file
    images_dropped: int
    entries_dropped: int  # other than images
    error: str  # why the recording ended before the run did, or ""


class Recorder:
    """Takes entries and writes them to ``file``; the first ``put`` starts the thread.

    ``clock`` runs by itself; None on simulated time. ``warn`` is told once, by the thread, when
    the recording ends early.
    """

    def __init__(
        self,
        file: McapFile,
        encoder: Encoder,
        clock: Clock | None,
        warn: Callable[[str], None],
    ) -> None:
        self._file = file
        self._encoder = encoder
        self._clock = clock
        self._warn = warn
        self._waiting: deque[tuple[float, Entry]] = deque()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        # Each is written by one side only, so that no lock is needed.
        self._put_bytes = self._taken_bytes = 0
        self._images = self._images_dropped = self._entries_dropped = 0
        self._error = ""
        self._flushed_s = float("-inf")
        self._fresh = False  # whether the file holds something that was not flushed
        self._result: Recorded | None = None

    def put(self, entry: Entry, logged_s: float) -> None:
        """Hand over what was logged at an instant of the rig's clock."""
        if self._error or self._closing.is_set():
            return
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="log", daemon=True)
            self._thread.start()
        if self._clock is None:
            while not self._error and self._full(_AHEAD_IMAGE_BYTES, _AHEAD_ENTRIES):
                self._closing.wait(_ROOM_S)
        if isinstance(entry, Picture):
            if self._full(_MOST_IMAGE_BYTES, _MOST_ENTRIES):
                self._images_dropped += 1
                return
            self._put_bytes += entry.frame.image.nbytes
        elif len(self._waiting) >= _MOST_ENTRIES:
            self._entries_dropped += 1
            return
        self._waiting.append((logged_s, entry))

    def close(self) -> Recorded:
        """Write the rest and the index; what became of it all. Harmless when repeated."""
        if self._result is None:
            self._closing.set()
            if self._thread is None:
                self._guarded(self._file.close)
            else:
                self._thread.join(_CLOSE_TIMEOUT_S)
                if self._thread.is_alive():
                    self._fail(f"the rest was not written within {_CLOSE_TIMEOUT_S:g} s")
            self._result = Recorded(
                self._file.size_bytes,
                self._images,
                self._images_dropped,
                self._entries_dropped,
                self._error,
            )
        return self._result

    def _full(self, most_bytes: int, most_entries: int) -> bool:
        waiting_bytes = self._put_bytes - self._taken_bytes
        return waiting_bytes >= most_bytes or len(self._waiting) >= most_entries

    def _work(self) -> None:
        step_back()
        try:
            self._guarded(self._serve)
        except BaseException as error:  # a mistake in this program: nobody must wait for the thread
            self._fail(repr(error))
            raise

    def _serve(self) -> None:
        while not self._closing.wait(_EVERY_S):
            self._drain()
            if self._clock is not None:  # the loop may have nothing more to say
                self._flush(self._clock.now_s())
        self._drain()
        if not self._error:
            self._file.close()

    def _drain(self) -> None:
        while self._waiting and not self._error:
            logged_s, entry = self._waiting.popleft()
            logged_ns = self._encoder.ns(logged_s)
            if isinstance(entry, Attached):
                self._file.attach(entry.name, entry.data, logged_ns)
                continue
            for message in self._encoder.messages(entry):
                self._file.write(message, logged_ns)
            if isinstance(entry, Picture):
                self._taken_bytes += entry.frame.image.nbytes
                self._images += 1
            self._fresh = True
            # By the rig's clock: on simulated time the same chunks every time.
            self._flush(logged_s, _EVENT_AFTER_S if isinstance(entry, Happened) else _FLUSH_AFTER_S)

    def _flush(self, now_s: float, after_s: float = _FLUSH_AFTER_S) -> None:
        if self._fresh and now_s - self._flushed_s >= after_s:
            self._file.flush()
            self._flushed_s, self._fresh = now_s, False

    def _guarded(self, action: Callable[[], None]) -> None:
        """A recording that cannot go on ends; the run does not."""
        try:
            action()
        except (OSError, ValueError, McapError, struct.error) as error:
            self._fail(str(error))
            self._file.abandon()

    def _fail(self, why: str) -> None:
        if not self._error:
            self._error = why
            self._warn(f"warning: the recording ends here, the run goes on: {why}")


def warn_on_stderr(text: str) -> None:
    """One line."""
    print(text, file=sys.stderr)
