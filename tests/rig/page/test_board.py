"""The board: the newest states arrive whole, the oldest are lost, and nobody waits."""

import os
from collections.abc import Iterator

import pytest

from rig.page.board import SLOT_BYTES, SLOTS, Board


@pytest.fixture
def ends() -> Iterator[tuple[Board, Board]]:
    """The writer's end and the reader's."""
    writer, file = Board.create()
    yield writer, Board(file)
    os.close(file)


def test_messages_arrive_in_order_and_once(ends: tuple[Board, Board]) -> None:
    writer, reader = ends
    assert reader.take() == []
    for word in (b"one", b"", b"three"):
        writer.post(word)
    assert reader.take() == [b"one", b"", b"three"]
    assert reader.take() == []


@pytest.mark.parametrize("posted", [SLOTS, SLOTS + 1, 10 * SLOTS + 7])
def test_a_reader_that_was_away_finds_the_newest_whole(
    ends: tuple[Board, Board], posted: int
) -> None:
    writer, reader = ends
    for number in range(posted):
        writer.post(b"%d" % number)
    found = [int(message) for message in reader.take()]
    # One slot may always be in the middle of being written.
    assert found == list(range(posted - SLOTS + 1, posted))


def test_what_is_overwritten_while_it_is_copied_is_thrown_away(
    ends: tuple[Board, Board], monkeypatch: pytest.MonkeyPatch
) -> None:
    writer, reader = ends
    for number in range(SLOTS):
        writer.post(b"%d" % number)
    copy = Board._copy

    def overtaken(self: Board, number: int) -> bytes:
        if number == SLOTS - 1:  # the last one copied: the writer has gone on meanwhile
            for later in range(SLOTS, SLOTS + 40):
                writer.post(b"%d" % later)
        return copy(self, number)

    monkeypatch.setattr(Board, "_copy", overtaken)
    found = [int(message) for message in reader.take()]
    assert found == list(range(41, SLOTS))


def test_a_message_too_long_for_a_slot_is_dropped(ends: tuple[Board, Board]) -> None:
    writer, reader = ends
    writer.post(b"x" * SLOT_BYTES)
    writer.post(b"short")
    assert reader.take() == [b"short"]


def test_a_stop_request_is_seen_at_the_other_end(ends: tuple[Board, Board]) -> None:
    writer, reader = ends
    assert writer.stop_requests == 0
    reader.request_stop()
    reader.request_stop()
    assert writer.stop_requests == 2


def test_a_page_that_writes_nonsense_does_no_more_than_ask_for_a_stop(
    ends: tuple[Board, Board],
) -> None:
    writer, reader = ends
    reader._map[:] = os.urandom(len(reader._map))
    reader._counts[0] = 2**62
    writer.post(b"on")  # neither fails nor waits
    assert isinstance(writer.stop_requests, int)
