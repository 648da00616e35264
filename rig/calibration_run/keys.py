"""Single key presses from a terminal; Ctrl-C stays a signal."""

import os
import select
import sys
import termios
import tty
from types import TracebackType
from typing import Self

from drivers.errors import ConfigError


class Keys:
    """Reads keys as they are pressed, for the duration of a ``with`` block.

    Raises ConfigError where standard input is no terminal.
    """

    def __init__(self) -> None:
        if not sys.stdin.isatty():
            raise ConfigError("--manual reads keys from a terminal: standard input is none")
        self._file = sys.stdin.fileno()
        self._before = termios.tcgetattr(self._file)

    def __enter__(self) -> Self:
        tty.setcbreak(self._file)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def poll(self, wait_s: float) -> str:
        """The next key pressed within ``wait_s`` of real time, or ""."""
        ready, _, _ = select.select([self._file], [], [], wait_s)
        if not ready:
            return ""
        return os.read(self._file, 1).decode("ascii", errors="replace")
