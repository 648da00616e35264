"""Standard output and error that survive their reader: a closed terminal, ``| head -1``.

A run must end with its arm at rest and its files written whoever reads along. So a write to a
reader that is gone is dropped instead of raising in the middle of a control tick, and remembered:
a run that nobody watches any more is asked to stop.
"""

import contextlib
import os
import sys
from collections.abc import Iterator
from typing import Any, TextIO


class PatientStream:
    """A text stream whose writes never fail; ``gone`` tells that one would have."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.gone = False

    def write(self, text: str) -> int:
        """Write ``text`` if anybody reads it."""
        try:
            return self._stream.write(text)
        except OSError:
            self._lose()
            return len(text)

    def flush(self) -> None:
        """Pass on what is buffered, if anybody reads it."""
        try:
            self._stream.flush()
        except OSError:
            self._lose()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def _lose(self) -> None:
        self.gone = True
        # What is still buffered must go somewhere, or the interpreter's own end would complain.
        with contextlib.suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self._stream.fileno())
            os.close(null)


@contextlib.contextmanager
def patient_output() -> Iterator[None]:
    """Put patient streams in the place of ``sys.stdout`` and ``sys.stderr``."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = PatientStream(sys.stdout), PatientStream(sys.stderr)
    try:
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        sys.stdout, sys.stderr = before


def reader_is_gone() -> bool:
    """Whether a write to standard output or error has failed."""
    return any(getattr(stream, "gone", False) for stream in (sys.stdout, sys.stderr))
