import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.grbl.protocol import (
    AlarmMessage,
    Banner,
    Info,
    LineReader,
    Message,
    Ok,
    Refusal,
    Setting,
    Status,
    Unknown,
    parse,
)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("ok", Ok()),
        ("error:15", Refusal(15)),
        ("error:later", Refusal(0)),
        ("ALARM:2", AlarmMessage(2)),
        ("$110=15000.000", Setting(110, "15000.000")),
        ("[AXS:6:XYZABC]", Info("AXS", "6:XYZABC")),
        ("Grbl 1.1h ['$' for help]", Banner("Grbl 1.1h ['$' for help]")),
        (
            "<Jog|MPos:1.000,-2.500,3.000|Bf:100,1023|FS:600,0|WCO:0.000,0.000,0.000>",
            Status("Jog", None, (1.0, -2.5, 3.0), 100, 1023, ""),
        ),
        (
            "<Door:1|MPos:0.000,0.000,0.000|Pn:XD>",
            Status("Door", 1, (0.0, 0.0, 0.0), None, None, "XD"),
        ),
        ("<Home|MPos:0.000|H:0,3>", Status("Home", None, (0.0,), None, None, "", False)),
        ("<Idle|MPos:0.000|H:1>", Status("Idle", None, (0.0,), None, None, "", True)),
        ("<Idle|MPos:1.0,nan,2.0|Bf:1,2>", Unknown("<Idle|MPos:1.0,nan,2.0|Bf:1,2>")),
        ("<Idle|MPos:1.0,2.0", Unknown("<Idle|MPos:1.0,2.0")),
        ("okok", Unknown("okok")),
        ("", Unknown("")),
    ],
)
def test_a_line_and_its_meaning(line: str, message: Message) -> None:
    assert parse(line) == message


def test_a_banner_is_known_by_its_end() -> None:
    assert isinstance(parse("xx\x00GrblHAL 1.1f ['$' or '$HELP' for help]"), Banner)


@given(st.text(max_size=200))
def test_any_line_is_some_message(text: str) -> None:
    message = parse(text)
    assert isinstance(
        message, Ok | Refusal | AlarmMessage | Banner | Setting | Info | Status | Unknown
    )
    if isinstance(message, Status) and message.position is not None:
        assert all(math.isfinite(value) for value in message.position)


@given(
    st.sampled_from(["Idle", "Jog", "Hold:0", "Alarm:1", "Door:2"]),
    st.text(alphabet="0123456789.,-+:|eEnaif<>", max_size=80),
)
def test_damaged_reports_keep_their_numbers_finite(state: str, rest: str) -> None:
    message = parse(f"<{state}|MPos:{rest}>")
    if isinstance(message, Status) and message.position is not None:
        assert all(math.isfinite(value) for value in message.position)


@given(st.lists(st.binary(max_size=64), max_size=20))
def test_any_bytes_are_lines_and_later_lines_are_found(chunks: list[bytes]) -> None:
    reader = LineReader(115200)
    for chunk in chunks:
        reader.feed(chunk, 0.0)
    reader.feed(b"\n", 0.0)
    assert [line.text for line in reader.feed(b"ok\r\n", 0.0)] == ["ok"]


def test_endless_noise_is_dropped_up_to_the_next_line() -> None:
    reader = LineReader(115200)
    for _ in range(1000):
        assert reader.feed(b"x" * 100, 0.0) == []
    lines = [line.text for line in reader.feed(b"x\r\nok\r\n", 0.0)]
    assert lines == ["ok"]


def test_a_line_is_stamped_when_its_first_bit_was_sent() -> None:
    reader = LineReader(10_000)  # a byte per millisecond
    reader.feed(b"abc", 1.0)
    first, second = reader.feed(b"de\r\nok\r\n", 1.020)
    assert (first.text, second.text) == ("abcde", "ok")
    # Eleven bytes until the end of the chunk, the last four of them the second line's.
    assert first.begun_s == pytest.approx(1.020 - 0.011)
    assert second.begun_s == pytest.approx(1.020 - 0.004)


@given(st.binary(min_size=1, max_size=300), st.integers(1, 20))
def test_lines_do_not_depend_on_how_bytes_arrive(data: bytes, size: int) -> None:
    whole = [line.text for line in LineReader(9600).feed(data + b"\n", 0.0)]
    reader = LineReader(9600)
    pieces = [data[i : i + size] for i in range(0, len(data), size)]
    parts = [line.text for piece in [*pieces, b"\n"] for line in reader.feed(piece, 0.0)]
    assert parts == whole
