import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.grbl.controller import (
    Controller,
    longest_line_bytes,
    lookahead_blocks,
    segment_s,
)
from drivers.grbl.flow import Flow
from drivers.grbl.limits import AxisLimits
from drivers.grbl.settings import standard_axes
from drivers.grbl.stream import JogStream
from sim_backend.loopback_grbl.machine import Machine
from tests.drivers.grbl.simulated import axes_of


def controller(axes: int = 6) -> Controller:
    return Controller(
        banner="test",
        letters=tuple("XYZABC"[:axes]),
        columns=tuple(range(axes)),
        steps_per_unit=np.full(axes, 100.0),
        max_rate=np.array([250.0] * 3 + [360.0] * 3)[:axes],
        acceleration=np.array([1000.0] * 3 + [2000.0] * 3)[:axes],
        mpos=np.zeros(axes),
        planner_blocks=100,
        rx_bytes=1023,
        round_trips_s=(0.007,),
        notes=(),
    )


def words(line: bytes) -> dict[str, float]:
    assert re.fullmatch(rb"\$J=G91G21([A-Z]-?\d+\.\d+)+\n", line)
    found = re.findall(r"([XYZABCF])(-?[\d.]+)", line.decode()[9:])
    return {letter: float(value) for letter, value in found}


@given(
    st.lists(st.floats(-30.0, 30.0), min_size=6, max_size=6),
    st.integers(10, 300),
)
def test_rounding_never_accumulates(rates: list[float], blocks: int) -> None:
    stream = JogStream(controller(), 0.010)
    wanted = np.array(rates)
    sent, time_s = np.zeros(6), 0.0
    for _ in range(blocks):
        block = stream.next(wanted, time_s)
        time_s += stream.duration_s(wanted)
        if block is None:
            continue
        for letter, value in words(block.line).items():
            if letter != "F":
                sent["XYZABC".index(letter)] += value
    assert np.abs(sent - stream.target).max() <= 0.0005 + 1e-9


def test_the_feed_gives_each_block_its_duration() -> None:
    stream = JogStream(controller(), 0.010)
    block = stream.next(np.array([30.0, 0.0, 0.0, 40.0, 0.0, 0.0]), 0.0)
    assert block is not None
    found = words(block.line)
    assert found == {"X": 0.3, "A": 0.4, "F": 3000.0}
    assert block.duration_s == 0.010


def test_slow_motion_gets_longer_blocks() -> None:
    stream = JogStream(controller(), 0.010)
    assert stream.duration_s(np.array([2.0, 0, 0, 0, 0, 0])) == pytest.approx(0.025)
    assert stream.duration_s(np.array([0.1, 0, 0, 0, 0, 0])) == pytest.approx(0.050)
    assert stream.duration_s(np.array([100.0, 0, 0, 0, 0, 0])) == pytest.approx(0.010)


def test_creeping_adds_up_instead_of_being_lost_or_hurried() -> None:
    stream = JogStream(controller(), 0.010)
    rates = np.array([0.004, 0, 0, 0, 0, 0])  # 0.2 µm in a block of 50 ms
    lines, now_s = 0, 0.0
    while now_s < 10.0:
        block = stream.next(rates, now_s)
        lines += block is not None
        now_s += 0.002 if block is None else block.duration_s
    assert stream.target[0] == pytest.approx(0.04, rel=0.06)
    assert lines == pytest.approx(40, abs=3)


@pytest.mark.parametrize("axes", [3, 6])
def test_no_line_is_longer_than_promised(axes: int) -> None:
    stream = JogStream(controller(axes), 0.050)
    fastest = -controller(axes).max_rate * 0.999
    for least_s in (0.0, 0.110):
        block = stream.next(fastest, 0.0, least_s)
        assert block is not None
        assert len(block.line) <= longest_line_bytes(axes)


def test_rest_sends_nothing() -> None:
    assert JogStream(controller(), 0.010).next(np.zeros(6), 0.0) is None


def test_the_line_decides_the_block() -> None:
    assert segment_s(115200, 6) == 0.020
    assert segment_s(115200, 3) == 0.010
    assert segment_s(1_000_000, 6) == 0.010
    assert (lookahead_blocks(0.010), lookahead_blocks(0.020)) == (4, 3)


def test_motion_under_way_is_what_was_sent_less_what_was_prepared() -> None:
    flow = Flow(100)
    flow.reported(100, 0.0)
    for _ in range(4):
        flow.sent(0.010, 50)
    assert flow.ahead_s(0.0) == pytest.approx(0.040)
    assert flow.unacknowledged_bytes == 200
    flow.acknowledged(0.001)
    flow.acknowledged(0.001)
    assert flow.unacknowledged_bytes == 100
    flow.reported(98, 0.002)
    assert flow.ahead_s(0.002) == pytest.approx(0.040)
    assert flow.ahead_s(0.012) == pytest.approx(0.030)  # time works off what is planned
    flow.reported(100, 0.015)
    assert flow.ahead_s(0.015) == pytest.approx(0.020)


def test_what_was_never_acknowledged_does_not_vanish_by_waiting() -> None:
    flow = Flow(100)
    for _ in range(4):
        flow.sent(0.010, 50)
    assert flow.ahead_s(1000.0) == pytest.approx(0.040)


def test_an_acknowledgement_too_many_is_ignored() -> None:
    flow = Flow(100)
    flow.acknowledged(0.0)
    flow.sent(0.010, 50)
    assert flow.ahead_s(0.0) == pytest.approx(0.010)


@given(st.lists(st.floats(-400.0, 400.0), min_size=6, max_size=6), st.floats(-1600.0, 0.0))
def test_one_factor_keeps_every_axis_within_speed_and_range(rates: list[float], x: float) -> None:
    machine = Machine()
    limits = AxisLimits(axes_of(machine), controller())
    position = machine.column((x, -800.0, -800.0, 0.0, 0.0, 0.0))
    wanted = np.array(rates)
    scale = limits.scale(position, wanted)
    assert 0.0 <= scale <= 1.0
    assert np.all(np.abs(scale * wanted) <= controller().max_rate + 1e-9)
    after = position + scale * wanted * 0.11  # the longest block
    assert np.all(after >= machine.column(machine.low) - 1e-6)
    assert np.all(after <= machine.column(machine.high) + 1e-6)


def test_the_end_of_a_range_is_named() -> None:
    machine = Machine()
    limits = AxisLimits(axes_of(machine), controller())
    position = machine.column(machine.high)
    outwards = np.array([50.0, 0, 0, 0, 0, 0])
    assert "X (x) is at the end of its range, 0 " in str(limits.blocked_by(position, outwards))
    assert limits.blocked_by(position, -outwards) is None


def test_axes_without_a_range_have_none() -> None:
    limits = AxisLimits(standard_axes(3), controller(3))
    assert limits.scale(np.full(3, 1e6), np.array([50.0, 0.0, 0.0])) == 1.0


def test_an_axis_on_its_end_after_homing_does_not_keep_the_others_from_moving() -> None:
    machine = Machine()
    limits = AxisLimits(axes_of(machine), controller())
    homed = limits.high.copy()
    along_z = np.array([0.0, 1e-17, -5.0, 0.0, 0.0, 0.0])  # y by rounding
    assert limits.blocked_by(homed, along_z) is None
    assert limits.scale(homed, along_z) == 1.0
    blocked = limits.blocked_by(homed, np.array([0.0, 5.0, -5.0, 0.0, 0.0, 0.0]))
    assert blocked is not None and blocked.startswith("Y (y) is at the end")
