"""What the view's thread does for the loop: nothing is held up, no error is swallowed."""

import threading
from types import TracebackType
from typing import Self

import pytest

from rig.background_view import BackgroundView
from rig.outcome import LiveStatus
from rig.recorded.setup import RunSetup

PATIENCE_S = 10.0


class Screen:
    """A view that keeps what it is shown, and may be stuck or broken."""

    def __init__(self, stuck: bool = False, broken: bool = False) -> None:
        self.shown: list[LiveStatus] = []
        self.reached = threading.Event()
        self.free = threading.Event()
        self.broken = broken
        self.entered = self.left = False
        if not stuck:
            self.free.set()

    def show(self, status: LiveStatus) -> None:
        self.reached.set()
        assert self.free.wait(PATIENCE_S)
        if self.broken:
            raise BrokenPipeError(32, "Broken pipe")
        self.shown.append(status)

    def begin(self, setup: RunSetup) -> None:
        self.setup = setup

    def __enter__(self) -> Self:
        self.entered = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.left = True


def status(number: int) -> LiveStatus:
    """Any state; what is in it does not matter here."""
    return LiveStatus(*[number] * len(LiveStatus.__slots__))  # type: ignore[arg-type]


def test_the_newest_state_is_shown_last() -> None:
    screen = Screen()
    with BackgroundView(screen) as view:
        assert screen.entered
        for number in range(1000):
            view.show(status(number))
    assert screen.left
    assert screen.shown[-1] == status(999)


def test_a_terminal_that_takes_nothing_holds_up_nobody() -> None:
    screen = Screen(stuck=True)
    with BackgroundView(screen) as view:
        view.show(status(0))
        assert screen.reached.wait(PATIENCE_S)
        for number in range(1, 100):
            view.show(status(number))  # would wait for ever if it waited
        screen.free.set()
    assert screen.shown[-1] == status(99)
    assert len(screen.shown) < 100


def test_what_drawing_raises_is_raised_where_the_run_can_act_on_it() -> None:
    screen = Screen(stuck=True, broken=True)
    with BackgroundView(screen) as view:
        view.show(status(0))
        screen.free.set()
        with pytest.raises(BrokenPipeError):
            while screen.reached.wait(PATIENCE_S):
                view.show(status(1))
