"""Ctrl-C as a request: the first one asks the run to ramp down, a late third one insists."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Self

from drivers.clock import Clock, WallClock
from rig.output import reader_is_gone

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_INSISTING = 3
# Whoever presses Ctrl-C three times at once does not know yet whether the first one worked.
_PATIENCE_S = 2.0


class StopRequest:
    """Turns signals into a flag for the duration of a ``with`` block.

    Only the main thread may enter it. Until somebody asks for the flag, nothing moves that would
    have to be ramped down, and the first signal raises KeyboardInterrupt at once: opening devices
    can take long. Further ones leave the clean-up alone for two seconds. A third signal, two
    seconds after the first, raises KeyboardInterrupt, for a run that hangs; the arm then stops
    through the same clean-up as after a crash. An output whose reader is gone counts as a request
    as well.
    """

    def __init__(self, notice: str = "stopping the arm …", clock: Clock | None = None) -> None:
        self._notice = notice
        self._clock: Clock = WallClock() if clock is None else clock
        self._received = 0
        self._asked = False
        self._at_once = False
        self._first_s = 0.0
        self._previous: dict[int, object] = {}

    def __call__(self) -> bool:
        """Whether a stop was asked for."""
        self._asked = True
        return self._received > 0 or reader_is_gone()

    @contextmanager
    def at_once(self) -> Iterator[None]:
        """While nothing moves and nothing is written: a signal raises KeyboardInterrupt at once.

        So does one that came before. For long calculations, which ask for no flag.
        """
        self._at_once = True
        try:
            if self._received:
                raise KeyboardInterrupt
            yield
        finally:
            self._at_once = False

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
            self._first_s = self._clock.now_s()
            print(f"\n{self._notice}", file=sys.stderr, flush=True)
        patient = self._clock.now_s() <= self._first_s + _PATIENCE_S
        if self._asked and not self._at_once:
            leave = self._received >= _INSISTING and not patient
        else:
            # A closing terminal says so twice: the second must not cut short what the first began.
            leave = self._received == 1 or not patient
        if leave:
            raise KeyboardInterrupt
