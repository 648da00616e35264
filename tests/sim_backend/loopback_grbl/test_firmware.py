"""The conversation: what is answered, when, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_backend.loopback_grbl import faults
from sim_backend.loopback_grbl.machine import Machine
from tests.sim_backend.loopback_grbl.helpers import EXACT, EXACT_GRBL, Bench


def test_nothing_is_said_unasked() -> None:
    assert Bench().wait(1.0) == ""


def test_a_reset_prints_the_banner() -> None:
    bench = Bench()
    bench.send(b"\x18")
    assert bench.wait(0.03).strip() == "GrblHAL 1.1f ['$' or '$HELP' for help]"


def test_plain_grbl_has_its_own_banner_and_memory() -> None:
    bench = Bench(EXACT_GRBL)
    bench.send(b"\x18")
    assert bench.wait(0.03).strip() == "Grbl 1.1h ['$' for help]"
    assert "|Bf:15,127|" in bench.status()
    assert "$701" not in " ".join(bench.ask("$$", 0.5))


def test_a_status_report_comes_within_ten_milliseconds() -> None:
    bench = Bench()
    bench.send(b"?")
    assert bench.wait(0.012).startswith(
        "<Idle|MPos:-800.000,-800.000,-800.000,0.000,0.000,0.000|Bf:100,1023|FS:0,0"
    )


def test_the_build_names_axes_and_buffers() -> None:
    answer = Bench().ask("$I", 0.1)
    assert "[OPT:VNML+,100,1024,6,0]" in answer
    assert "[AXS:6:XYZABC]" in answer
    assert answer[-1] == "ok"


def test_requests_closer_than_a_160th_second_share_an_answer() -> None:
    bench = Bench(Machine(clock_rate=1.0, lost_status=0.0, baud=2_000_000))
    heard = ""
    for _ in range(500):
        bench.send(b"?")
        heard += bench.wait(0.002)
    assert heard.count("<") == pytest.approx(150, abs=12)


def test_some_requests_get_no_answer() -> None:
    bench = Bench(Machine(clock_rate=1.0, lost_status=0.03))
    answers = sum(bool(bench.status()) for _ in range(600))
    assert 0.94 * 600 <= answers <= 0.99 * 600


def test_ok_means_planned_and_committed_segments_are_in_no_report() -> None:
    bench = Bench()
    bench.stream(10.0, 0.04)  # two blocks of 20 ms, 0.4 mm
    assert bench.wait(0.010).count("ok") == 2
    report = bench.status()
    assert report.startswith("<Jog|")
    assert "Bf:100," in report
    assert bench.firmware.joints()[0][0, 0] < 0.0003
    bench.wait(0.2)
    assert bench.firmware.joints()[0][0, 0] == pytest.approx(0.0004)


def test_the_planner_holds_a_hundred_blocks_then_presses_back() -> None:
    bench = Bench()
    for _ in range(200):
        bench.send("$J=G91G21X0.500F600\n")  # 50 ms each
    assert 100 <= bench.wait(0.5).count("ok") <= 113
    assert 18 <= bench.wait(1.0).count("ok") <= 22  # one for each block that ends


def test_the_receive_buffer_presses_back_even_on_a_status_request() -> None:
    bench = Bench()
    for _ in range(250):
        bench.send("$J=G91G21X0.500F600\n")
    bench.wait(0.5)
    assert bench.status() == ""


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("$J=G91G21X1.2.3F100", "error:2"),
        ("$J=G91G21X1", "error:22"),
        ("$J=G93G91X1F10", "error:16"),
        ("$J=G91G21X5000F100", "error:15"),
        ("$Q", "error:3"),
        ("G1X1", "error:22"),
        ("$$$", "error:3"),
        ("", "ok"),
    ],
)
def test_a_line_and_its_answer(line: str, answer: str) -> None:
    assert Bench().ask(line) == [answer]


def test_a_jog_beyond_the_limits_moves_nothing() -> None:
    bench = Bench()
    bench.ask("$J=G90G21X1F1000")
    assert bench.status().startswith("<Idle|MPos:-800.000,")


def test_a_g_code_error_sticks_until_an_empty_line() -> None:
    bench = Bench()
    assert bench.ask("G1Q5") == ["error:20"]
    assert bench.ask("G91") == ["error:20"]
    assert bench.ask("$J=G91G21X1F1000") == ["ok"]  # jogs pass by
    bench.wait(0.5)
    assert bench.ask("G91") == ["error:20"]
    assert bench.ask("") == ["ok"]
    assert bench.ask("G91") == ["ok"]


def test_a_programme_is_locked_out_while_jogging_and_a_jog_while_a_programme_runs() -> None:
    bench = Bench()
    bench.send("$J=G91G21X10F600\n")
    assert bench.ask("G1X1F100", 0.1) == ["ok", "error:9"]
    bench.wait(2.0)
    bench.ask("")
    bench.send("G91G1X10F600\n")
    assert bench.ask("$J=G91G21X1F600", 0.1) == ["ok", "error:8"]


def test_a_programme_beyond_the_limits_is_alarm_two_without_ok() -> None:
    bench = Bench()
    assert bench.ask("G90G1X100F1000")[0] == "ALARM:2"
    assert bench.status().startswith("<Alarm:2|")
    assert bench.ask("$J=G91G21X1F100") == ["error:79"]
    assert bench.ask("$X") == ["error:79"]
    bench.send(b"\x18")
    bench.wait(0.1)
    assert bench.ask("$J=G91G21X1F100") == ["error:9"]
    assert bench.ask("$X")[-1] == "ok"
    assert bench.ask("$J=G91G21X1F100") == ["ok"]


def test_a_gantry_that_was_just_switched_on_is_locked_until_homed() -> None:
    bench = Bench(locked=True)
    assert bench.status().startswith("<Alarm|")
    assert bench.ask("$J=G91G21X1F100") == ["error:9"]
    bench.send("$H\n")
    bench.wait(0.5)
    assert bench.status().startswith("<Home|")
    bench.wait(10.0)
    assert bench.status().startswith("<Idle|MPos:0.000,0.000,0.000,")


def test_a_limit_switch_stops_the_pulses_and_locks() -> None:
    bench = Bench()
    bench.stream(50.0, 0.8)
    bench.wait(0.4)
    faults.inject(bench.firmware, "alarm")
    begun_s = bench.now_s
    assert "ALARM:1" in bench.wait(0.1)
    _, _, qd = bench.motion(begun_s + 0.002)
    assert not qd.any()
    assert bench.status().startswith("<Alarm:1|")
    assert "Pn:X" in bench.status()


def test_an_open_door_ends_a_jog_and_holds_until_closed() -> None:
    bench = Bench()
    bench.stream(50.0, 0.8)
    bench.wait(0.4)
    faults.inject(bench.firmware, "door")
    bench.wait(0.2)
    assert bench.status().startswith("<Door:1|")
    bench.send(b"~")
    bench.wait(0.05)
    assert bench.status().startswith("<Door:1|")
    faults.clear(bench.firmware, "door")
    assert bench.status().startswith("<Door:0|")
    bench.send(b"~")
    bench.wait(0.05)
    assert bench.status().startswith("<Idle|")
    assert not bench.firmware.joints()[1].any()


def test_an_emergency_stop_cannot_be_unlocked_while_pressed() -> None:
    bench = Bench()
    faults.inject(bench.firmware, "emergency_stop")
    bench.wait(0.05)
    bench.send(b"\x18")
    bench.wait(0.1)
    assert bench.ask("$X") == ["error:79"]
    faults.clear(bench.firmware, "emergency_stop")
    bench.send(b"\x18")
    bench.wait(0.1)
    assert bench.ask("$X")[-1] == "ok"


def test_a_stall_is_silent_while_the_motors_go_on() -> None:
    bench = Bench()
    bench.stream(50.0, 0.8)
    bench.wait(0.3)
    faults.inject(bench.firmware, "stall")
    assert bench.status() == ""
    bench.wait(1.5)
    assert bench.firmware.joints()[0][0, 0] == pytest.approx(0.040, abs=1e-9)


def test_an_unknown_fault_lists_the_known_ones() -> None:
    with pytest.raises(KeyError, match="door"):
        faults.inject(Bench().firmware, "fire")


def test_joints_and_machine_positions_are_inverse() -> None:
    q = np.array([0.1, -0.2, 0.3, 0.4, -0.5, 0.6])
    assert EXACT.joints(EXACT.machine_position(q)) == pytest.approx(q)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.binary(max_size=40), max_size=6))
def test_garbage_neither_stops_nor_confuses_the_clockwork(chunks: list[bytes]) -> None:
    bench = Bench()
    for chunk in chunks:
        bench.send(chunk)
        bench.wait(0.01)
    bench.send(b"\n\x18")
    bench.wait(0.4)
    bench.send(b"\n$X\n")
    bench.wait(0.2)
    assert bench.status()[:5] in ("<Idle", "<Door")
