"""``rig arm`` as a person types it, on the loopback controller and the simulated arm."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from drivers.clock import WallClock
from drivers.errors import ConfigError, ConnectError, OperateError
from rig.commands.arm import arm_app
from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.server import LoopbackGantry
from sim_backend.loopback_ur.process import LoopbackProcess
from tests.drivers.ur.loopback import last_motion_s, start_loopback

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def loopback() -> Iterator[LoopbackProcess]:
    with start_loopback(unlock_after_s=0.2) as process:
        yield process


def rig_arm(*arguments: str, answer: str | None = None):
    result = CliRunner().invoke(arm_app, list(arguments), input=answer)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def test_status_tells_what_the_controller_says_and_uploads_nothing(loopback):
    result = rig_arm("status", "--arm", "ur", "--host", loopback.host, "--json")
    facts = json.loads(result.stdout)
    assert result.exit_code == 0
    assert facts["controller"] == "UR5 5.15.0.0"
    assert (facts["safety"], facts["mode"], facts["program"]) == ("normal", "running", "stopped")
    assert facts["problem"] is None
    assert facts["state_rate_hz"] == pytest.approx(500.0, rel=0.02)
    assert facts["tool_position_m"] == pytest.approx([0.4919, -0.1333, 0.4879], abs=1e-4)


def test_jog_reports_commanded_against_measured(loopback):
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    start_s = CLOCK.now_s()
    arguments = ["--twist", "0.04,0,0.02,0,0,0.1", "--for", "0.8", "--frame", "tool", "--json"]
    result = rig_arm("jog", "--arm", "ur", "--host", loopback.host, *arguments)
    facts = json.loads(result.stdout)
    assert result.exit_code == 0
    assert facts["linear_error_m_s"] < 0.02 * np.linalg.norm([0.04, 0.02])
    assert 0.0 < facts["latency_s"] < 0.2
    assert 0.0 < facts["stop_s"] < 0.5
    assert last_motion_s(loopback, start_s) < CLOCK.now_s()
    assert facts["moved_m"] == pytest.approx(0.8 * np.linalg.norm([0.04, 0.02]), rel=0.15)


def test_jog_in_a_terminal_is_a_table(loopback):
    result = rig_arm("jog", "--arm", "sim", "--twist", "0,0.05,0,0,0,0", "--for", "0.3")
    assert result.exit_code == 0
    assert "latency s" in result.stdout and "measured" in result.stdout


def test_a_stopped_arm_is_explained_and_recovered_only_after_a_yes(loopback):
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    loopback.control.fault("protective_stop")
    CLOCK.sleep_until(CLOCK.now_s() + 0.3)
    status = rig_arm("status", "--arm", "ur", "--host", loopback.host)
    assert status.exit_code == 3
    assert "protective stop" in status.stdout
    with pytest.raises(ConnectError, match="protective stop"):
        arguments = ["--twist", "0.04,0,0,0,0,0", "--for", "0.3"]
        rig_arm("jog", "--arm", "ur", "--host", loopback.host, *arguments)
    with pytest.raises(OperateError, match="nothing was unlocked"):
        rig_arm("recover", "--arm", "ur", "--host", loopback.host, answer="n\n")
    recovered_s = CLOCK.now_s()
    result = rig_arm("recover", "--arm", "ur", "--host", loopback.host, "--yes")
    assert result.exit_code == 0
    assert "clear its way" in result.stdout
    assert "takes commands again" in result.stdout
    assert last_motion_s(loopback, recovered_s) == recovered_s


@pytest.fixture
def gantry(tmp_path) -> Iterator[LoopbackGantry]:
    """A gantry 100 mm from its home corner."""
    machine = Machine()
    start = machine.column((-100.0, -100.0, -100.0, 5.0, 5.0, 5.0))
    with LoopbackGantry(machine, start, tmp_path / "gantry", CLOCK) as running:
        yield running


def test_a_gantry_tells_its_state_its_delays_and_whether_it_moves(gantry):
    result = rig_arm("status", "--arm", "grbl", "--port", str(gantry.port), "--json")
    facts = json.loads(result.stdout)
    assert result.exit_code == 0
    assert facts["state"].startswith("The gantry is ready")
    assert 0.0 < facts["round_trip_s"] < 0.1
    assert 0.1 < facts["command_delay_s"] < 0.3
    assert not facts["command_delay_measured"]
    assert facts["bandwidth_hz"] == pytest.approx(0.125 / facts["command_delay_s"])


def test_a_gantry_is_homed_only_after_a_yes(gantry):
    port = str(gantry.port)
    before, _ = gantry.joints()
    with pytest.raises(OperateError, match=r"not homed.*nothing moved"):
        rig_arm("home", "--arm", "grbl", "--port", port, answer="n\n")
    assert np.array_equal(gantry.joints()[0], before)
    result = rig_arm("home", "--arm", "grbl", "--port", port, "--yes")
    assert result.exit_code == 0
    assert "every axis to its switch" in result.stdout
    assert "is homed; its tool is at" in result.stdout
    home = Machine().joints(np.zeros(6))
    assert gantry.joints()[0] == pytest.approx(home, abs=1e-6)


def test_what_held_a_motion_back_is_named_in_the_table(gantry, tmp_path):
    rig_arm("home", "--arm", "grbl", "--port", str(gantry.port), "--yes")
    config = yaml.safe_load((CONFIGS / "loopback_gantry.yaml").read_text(encoding="utf-8"))
    config["arm"]["port"] = str(gantry.port)
    rig = tmp_path / "lab.yaml"
    rig.write_text(yaml.safe_dump(config))
    jog = ("jog", "--arm", "grbl", "--rig", str(rig), "--for", "0.3")
    up = rig_arm(*jog, "--twist", "0,0,0.005,0,0,0")
    assert "[joint z max]" in up.stdout
    down = json.loads(rig_arm(*jog, "--twist", "0,0,-0.005,0,0,0", "--json").stdout)
    assert down["allowed"] == pytest.approx([0, 0, -0.005, 0, 0, 0])


def test_a_locked_gantry_is_homed_and_then_free(gantry):
    gantry.inject("alarm")
    assert rig_arm("status", "--arm", "grbl", "--port", str(gantry.port)).exit_code == 3
    result = rig_arm("home", "--arm", "grbl", "--port", str(gantry.port), "--yes")
    assert "The gantry is locked" in result.stdout
    assert rig_arm("status", "--arm", "grbl", "--port", str(gantry.port)).exit_code == 0


def test_arms_without_homing_say_so_and_ask_nothing():
    with pytest.raises(ConfigError, match="nothing to home, and nothing moved"):
        rig_arm("home", "--arm", "ur", "--host", "127.0.0.1")
    assert "always knows where it is" in rig_arm("home", "--arm", "sim").stdout


def test_stop_stops_the_program(loopback):
    result = rig_arm("stop", "--arm", "ur", "--host", loopback.host)
    assert result.exit_code == 0
    assert "Stopped" in result.stdout


def test_ctrl_c_stops_the_arm(loopback):
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    code = "from rig.commands.arm import arm_app; arm_app()"
    arguments = ["jog", "--arm", "ur", "--host", loopback.host, "--for", "20"]
    arguments += ["--twist", "0.03,0,0,0,0,0", "--json"]
    start_s = CLOCK.now_s()
    with subprocess.Popen(
        [sys.executable, "-c", code, *arguments], stdout=subprocess.PIPE, start_new_session=True
    ) as process:
        try:
            while last_motion_s(loopback, start_s) == start_s:
                assert process.poll() is None and CLOCK.now_s() < start_s + 20.0
                CLOCK.sleep_until(CLOCK.now_s() + 0.05)
            interrupted_s = CLOCK.now_s()
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does it: to the whole group
            output, _ = process.communicate(timeout=15.0)
        finally:
            process.kill()
    assert process.returncode == 130
    assert json.loads(output)["interrupted"]
    assert last_motion_s(loopback, start_s) - interrupted_s < 0.5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["jog", "--arm", "ur", "--twist", "1,2,3", "--for", "1"], "vx,vy,vz"),
        (["jog", "--arm", "ur", "--twist", "a,0,0,0,0,0", "--for", "1"], "could not convert"),
        (["status", "--arm", "ur"], "--host"),
        (["status", "--arm", "grbl"], "--port"),
    ],
)
def test_wrong_usage_says_what_is_missing(arguments, message):
    with pytest.raises(ConfigError, match=message):
        rig_arm(*arguments)
