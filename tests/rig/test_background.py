"""What threads do for the loop: nothing is lost, nothing is held up, no error is swallowed."""

import io
import threading
from pathlib import Path
from types import TracebackType
from typing import Self

import pytest

from rig.background_file import BackgroundFile
from rig.background_view import BackgroundView
from rig.outcome import LiveStatus

PATIENCE_S = 10.0


class StuckFile(io.StringIO):
    """A file on a disk that is busy until a test says otherwise."""

    def __init__(self) -> None:
        super().__init__()
        self.reached = threading.Event()
        self.free = threading.Event()

    def write(self, text: str) -> int:
        self.reached.set()
        assert self.free.wait(PATIENCE_S)
        return super().write(text)


class FullFile(io.StringIO):
    """A file on a disk with no space left."""

    def __init__(self) -> None:
        super().__init__()
        self.reached = threading.Event()

    def write(self, text: str) -> int:
        self.reached.set()
        raise OSError(28, "No space left on device")


def test_everything_written_is_in_the_file_in_order(tmp_path: Path) -> None:
    path = tmp_path / "log"
    file = BackgroundFile(path.open("w", encoding="utf-8"))
    lines = [f"line {number} → ü\n" for number in range(5000)]
    for line in lines:
        file.write(line)
    file.close()
    assert path.read_text(encoding="utf-8") == "".join(lines)


def test_a_file_nothing_was_written_to_is_empty_and_closed(tmp_path: Path) -> None:
    inner = (tmp_path / "log").open("w", encoding="utf-8")
    BackgroundFile(inner).close()
    assert inner.closed


def test_a_busy_disk_holds_up_nobody() -> None:
    slow = StuckFile()
    file = BackgroundFile(slow)
    file.write("a")
    assert slow.reached.wait(PATIENCE_S)
    file.write("b")  # would wait for ever if it waited
    file.flush()
    slow.free.set()
    slow.close = lambda: None  # type: ignore[method-assign]
    file.close()
    assert slow.getvalue() == "ab"


def test_a_full_disk_is_an_error_of_a_later_write_and_of_close() -> None:
    full = FullFile()
    file = BackgroundFile(full)
    file.write("a")
    assert full.reached.wait(PATIENCE_S)
    with pytest.raises(OSError, match="No space left"):
        file.close()
    with pytest.raises(OSError, match="No space left"):
        file.write("b")


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
