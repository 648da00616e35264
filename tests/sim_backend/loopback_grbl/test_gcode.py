import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_backend.loopback_grbl import gcode
from sim_backend.loopback_grbl.gcode import GcodeError, Modes, parse_move, parse_words

AT = np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0])


def code_of(line: str, jog: bool = True) -> int:
    with pytest.raises(GcodeError) as caught:
        parse_move(line, "XYZABC", Modes(), AT, jog)
    return caught.value.code


def test_a_relative_jog_adds_to_the_position() -> None:
    move = parse_move("G91G21X-0.5B2F600", "XYZABC", Modes(), AT, jog=True)
    assert move is not None
    assert move.target.tolist() == [0.5, 2.0, 3.0, 0.0, 2.0, 0.0]
    assert move.feed == 600.0


def test_inches_are_converted_feed_and_all() -> None:
    move = parse_move("G90G20X1F10", "XYZABC", Modes(), AT, jog=True)
    assert move is not None
    assert move.target[0] == pytest.approx(25.4)
    assert move.feed == pytest.approx(254.0)


def test_a_jog_leaves_the_modes_alone() -> None:
    modes = Modes()
    parse_move("G91G20X1F10", "XYZABC", modes, AT, jog=True)
    assert modes == Modes()


def test_g_code_keeps_its_modes() -> None:
    modes = Modes()
    assert parse_move("G91 G1 F300", "XYZABC", modes, AT, jog=False) is None
    move = parse_move("X1", "XYZABC", modes, AT, jog=False)
    assert move is not None
    assert (move.target[0], move.feed) == (2.0, 300.0)


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("X1.2.3F100", gcode.BAD_NUMBER),
        ("XF100", gcode.BAD_NUMBER),
        ("1X2F100", gcode.EXPECTED_LETTER),
        ("G91X1", gcode.NO_FEED),
        ("G91X1F0", gcode.NO_FEED),
        ("G93X1F10", gcode.BAD_JOG),
        ("G1X1F10", gcode.BAD_JOG),
        ("G90G91X1F10", gcode.SAME_GROUP_TWICE),
        ("G91F100", gcode.NO_AXIS_WORDS),
        ("G91U1F100", gcode.UNSUPPORTED),
        ("M3", gcode.UNSUPPORTED),
    ],
)
def test_a_bad_jog_has_its_number(line: str, code: int) -> None:
    assert code_of(line) == code


def test_three_axes_know_no_a_word() -> None:
    with pytest.raises(GcodeError) as caught:
        parse_move("A1F10", "XYZ", Modes(), AT[:3], jog=True)
    assert caught.value.code == gcode.UNSUPPORTED


@given(st.text(max_size=60))
def test_any_text_gives_words_or_a_number(text: str) -> None:
    try:
        words = parse_words(text)
    except GcodeError as error:
        assert error.code > 0
    else:
        assert all(np.isfinite(value) for _, value in words)
