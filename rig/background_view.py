"""A view drawn by a thread of its own, so that a slow terminal does not hold up the loop."""

import threading
from types import TracebackType
from typing import Self

from rig.live import View
from rig.outcome import LiveStatus
from rig.realtime import step_back
from rig.recorded.setup import RunSetup

_EVERY_S = 0.05
_JOIN_TIMEOUT_S = 1.0  # a terminal that takes nothing must not keep the run from ending


class BackgroundView:
    """Draws the newest status with ``view``; what drawing raises, the next ``show`` raises."""

    def __init__(self, view: View) -> None:
        self._view = view
        self._newest: LiveStatus | None = None
        self._drawn: LiveStatus | None = None
        self._error: Exception | None = None
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def begin(self, setup: RunSetup) -> None:
        """Hand it on, before time counts."""
        self._view.begin(setup)

    def show(self, status: LiveStatus) -> None:
        """Take the newest state."""
        if self._error is not None:
            raise self._error
        self._newest = status
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="view", daemon=True)
            self._thread.start()

    def __enter__(self) -> Self:
        self._view.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._ending.set()
        if self._thread is not None:
            self._thread.join(_JOIN_TIMEOUT_S)
        self._view.__exit__(kind, error, traceback)

    def _work(self) -> None:
        step_back()
        try:
            while not self._ending.wait(_EVERY_S):
                self._draw()
            self._draw()
        except Exception as error:  # noqa: BLE001 - it is raised again where the run can act on it
            self._error = error

    def _draw(self) -> None:
        status = self._newest
        if status is not None and status is not self._drawn:
            self._view.show(status)
            self._drawn = status
