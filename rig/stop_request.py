"""Ctrl-C as a request: the first one asks the run to ramp down, a third one insists."""

import signal
import sys
from types import FrameType, TracebackType
from typing import Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_INSISTING = 3


class StopRequest:
    """Turns signals into a flag for the duration of a ``with`` block.

    Only the main thread may enter it. The third signal raises KeyboardInterrupt, for a run that
    hangs; the arm then stops through the same clean-up as after a crash.
    """

    def __init__(self, notice: str = "stopping the arm …") -> None:
        self._notice = notice
        self._received = 0
        self._previous: dict[int, object] = {}

    def __call__(self) -> bool:
        """Whether a stop was asked for."""
        return self._received > 0

    def __enter__(self) -> Self:
        for number in _SIGNALS:
            self._previous[number] = signal.signal(number, self._receive)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)  # type: ignore[arg-type]

    def _receive(self, number: int, frame: FrameType | None) -> None:
        self._received += 1
        if self._received == 1:
            print(f"\n{self._notice}", file=sys.stderr, flush=True)
        if self._received >= _INSISTING:
            raise KeyboardInterrupt
