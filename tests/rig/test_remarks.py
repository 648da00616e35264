"""What an arm has to say about itself reaches whoever starts it moving."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.interfaces import CommandDelay
from drivers.ur import kinematics
from sim_backend.arm import SimulatedArm
from sim_backend.loopback_grbl.process import LoopbackGantryProcess
from sim_backend.loopback_ur.process import LoopbackProcess
from tests.drivers.ur.loopback import start_loopback
from tests.rig.command_line import rig
from tests.rig.log_lines import log_lines

REMARK = "something is only assumed"


def test_a_run_tells_it_once_and_records_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = SimulatedArm.__init__

    def with_remark(arm: SimulatedArm, *arguments: object) -> None:
        made(arm, *arguments)  # type: ignore[arg-type]
        arm.remarks = lambda: (REMARK,)  # type: ignore[attr-defined]

    monkeypatch.setattr(SimulatedArm, "__init__", with_remark)
    run = ("run", "--target", "sphere", "--duration", "0.5", "--set", "sim.level=features")
    outcome = rig(*run, "--no-report", "--out", str(tmp_path))
    assert outcome.stderr.count(f"warning: {REMARK}") == 1
    events = [line for line in log_lines(tmp_path) if line["kind"] == "event"]
    assert [event["detail"] for event in events if event["event"] == "arm's remark"] == [REMARK]


@pytest.fixture
def strange() -> Iterator[LoopbackProcess]:
    with start_loopback() as process:
        yield process


@pytest.mark.realtime
def test_a_ur_arm_of_a_model_that_is_not_known_says_that_its_joints_are_not_guarded(
    strange: LoopbackProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = ("--arm", "ur", "--host", strange.host)
    known = json.loads(rig("arm", "status", *address, "--json").stdout)
    assert (known["kinematics"], known["unguarded"]) == ("UR5e", None)
    others = tuple(model for model in kinematics.MODELS if model.name != "UR5e")
    monkeypatch.setattr(kinematics, "MODELS", others)
    status = rig("arm", "status", *address, "--json")
    assert status.exit_code == 0  # it can move all the same
    assert json.loads(status.stdout)["unguarded"] == kinematics.UNGUARDED
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    jog = rig("arm", "jog", *address, "--twist", "0,0,0.01,0,0,0", "--for", "0.1")
    assert jog.stderr.count(kinematics.UNGUARDED) == 1


def test_how_late_an_arm_follows_is_in_the_record_of_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = SimulatedArm.__init__

    def late(arm: SimulatedArm, *arguments: object) -> None:
        made(arm, *arguments)  # type: ignore[arg-type]
        arm.command_delay = lambda: CommandDelay(0.14, 0.007, measured=True)  # type: ignore[attr-defined]

    monkeypatch.setattr(SimulatedArm, "__init__", late)
    run = ("run", "--target", "sphere", "--duration", "0.5", "--set", "sim.level=features")
    rig(*run, "--no-report", "--out", str(tmp_path))
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["command_delay_s"], summary["command_delay_std_s"]) == (0.14, 0.007)
    assert summary["command_delay_measured"] is True


@pytest.mark.realtime
@pytest.mark.slow  # a machine too busy to command steadily shows no delay, and none is claimed
def test_jogging_a_gantry_measures_how_late_it_follows(tmp_path: Path) -> None:
    with LoopbackGantryProcess(tmp_path / "gantry") as gantry:
        jog = ("arm", "jog", "--arm", "grbl", "--port", str(gantry.port), "--json")
        facts = json.loads(rig(*jog, "--twist", "0.05,0,0,0,0,0", "--for", "2").stdout)
    assert facts["command_delay_measured"]
    assert 0.08 < facts["command_delay_s"] < 0.4
