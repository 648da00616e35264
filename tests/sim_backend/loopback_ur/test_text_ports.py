"""The dashboard's and the script port's texts."""

import re

from hypothesis import given
from hypothesis import strategies as st

from sim_backend.loopback_ur.config import ControllerConfig
from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.dashboard import Dashboard
from sim_backend.loopback_ur.safety import RobotMode
from sim_backend.loopback_ur.script_port import ScriptPort

SCRIPT = "def x():\n  read_input_integer_reg(0)\nend\n"


def running():
    controller = Controller(ControllerConfig(unlock_after_s=0.0))
    controller.start_program(SCRIPT)
    return controller, Dashboard(controller)


def test_it_says_what_the_vendor_client_looks_for():
    _, dashboard = running()
    assert re.search(r"\d+\.\d+\.\d+\.\d+", dashboard.answer("PolyscopeVersion"))
    assert dashboard.answer("get serial number").isdigit()
    assert dashboard.answer("is in remote control") == "true"
    assert dashboard.answer("running") == "Program running: true"
    assert dashboard.answer("programState").startswith("PLAYING")


def test_a_cb3_does_not_know_remote_control():
    dashboard = Dashboard(Controller(ControllerConfig(version=(3, 15, 8, 0))))
    assert dashboard.answer("is in remote control").startswith("could not understand")


def test_stop_pause_and_play_act_on_the_program():
    _, dashboard = running()
    assert dashboard.answer("play") == "Failed to execute: play"
    assert dashboard.answer("pause") == "Pausing program"
    assert dashboard.answer("programState").startswith("PAUSED")
    assert dashboard.answer("play") == "Starting program"
    assert dashboard.answer("stop") == "Stopped"
    assert dashboard.answer("running") == "Program running: false"
    assert dashboard.answer("pause") == "Failed to execute: pause"


def test_a_protective_stop_is_named_and_unlocked():
    controller, dashboard = running()
    controller.protective_stop()
    assert dashboard.answer("safetystatus") == "Safetystatus: PROTECTIVE_STOP"
    assert dashboard.answer("unlock protective stop") == "Protective stop releasing"
    assert dashboard.answer("safetymode") == "Safetymode: NORMAL"


def test_unlocking_too_early_is_refused_with_the_documented_text():
    controller = Controller(ControllerConfig())
    controller.protective_stop()
    refusal = Dashboard(controller).answer("unlock protective stop")
    assert refusal.startswith("Cannot unlock protective stop until 5s after occurrence")


def test_power_comes_back_in_two_steps():
    controller, dashboard = running()
    controller.robot_mode = RobotMode.POWER_OFF
    assert dashboard.answer("power on") == "Powering on"
    assert dashboard.answer("robotmode") == "Robotmode: IDLE"
    assert dashboard.answer("brake release") == "Brake releasing"
    assert dashboard.answer("robotmode") == "Robotmode: RUNNING"


@given(st.text(max_size=60))
def test_any_line_gets_one_line_back(line):
    reply = running()[1].answer(line.replace("\n", " "))
    assert reply
    assert "\n" not in reply


@given(st.lists(st.integers(1, 30), max_size=10))
def test_programs_end_at_the_end_in_column_zero_however_they_are_chopped(sizes):
    inner = "def a():\n  if True:\n    x = 1\n  end\nend\n"
    stream = (inner + SCRIPT).encode()
    port, got, at = ScriptPort(), [], 0
    for size in [*sizes, len(stream)]:
        got += port.feed(stream[at : at + size])
        at += size
    assert got == [inner, SCRIPT]


def test_text_without_an_end_is_thrown_away_in_time():
    port = ScriptPort()
    for _ in range(300):
        assert port.feed(b"x" * 4096) == []
    assert port.feed(SCRIPT.encode()) != []
