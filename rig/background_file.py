"""A file written by a thread of its own, so that a busy disk does not hold up who writes to it."""

import threading
from collections import deque
from typing import IO

from rig.realtime import step_back

_EVERY_S = 0.05


class BackgroundFile:
    """Takes text and writes it to ``file`` within about 50 ms; the first ``write`` starts it.

    What a write raises is raised by the next call. A process that is killed loses what came in
    the last moment, as it does with a buffered file.
    """

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._waiting: deque[str] = deque()
        self._error: Exception | None = None
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def write(self, text: str) -> None:
        """Hand ``text`` over."""
        if self._error is not None:
            raise self._error
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="log", daemon=True)
            self._thread.start()
        self._waiting.append(text)

    def flush(self) -> None:
        """Nothing to do: everything is on its way."""

    def close(self) -> None:
        """Write the rest and close the file."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
        self._file.close()
        if self._error is not None:
            raise self._error

    def _work(self) -> None:
        step_back()
        try:
            while not self._closing.wait(_EVERY_S):
                self._drain()
            self._drain()
        except (OSError, ValueError) as error:
            self._error = error

    def _drain(self) -> None:
        texts = []
        while self._waiting:
            texts.append(self._waiting.popleft())
        self._file.write("".join(texts))
        self._file.flush()
