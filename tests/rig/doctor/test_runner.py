"""Whatever a check does, it ends as one row, in bounded time, and the others are made."""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from drivers.clock import WallClock
from rig.config import RigConfig
from rig.doctor.checks import CHECKS, Check, checks_for
from rig.doctor.finding import Finding, Status, finding_of
from rig.doctor.runner import run_checks
from rig.doctor.subject import Subject, subject_of

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
SUBJECT = Subject(RigConfig(name="mine"), Path("/nowhere/runs"), quick=True, root=Path("/fake"))


def odd(name: str, limit_s: float = 120.0) -> Check:
    return Check(name, f"tests.rig.doctor.odd_checks:{name}", limit_s)


def run(*checks: Check, **options) -> list[Finding]:
    return list(run_checks(SUBJECT, checks, CLOCK, **options))


def test_checks_run_one_after_another_in_one_process_whatever_they_print_or_raise():
    names = ["fine", "not_a_number", "device_error", "defect", "fine"]
    begun: list[str] = []
    found = run(*(odd(name) for name in names), on_begin=begun.append)
    assert begun == [finding.name for finding in found] == names
    first, unknown, device, defect, last = found
    assert (first.status, first.measured) == (Status.OK, "mine")
    assert first.values["pid"] == last.values["pid"] != os.getpid()
    assert unknown.values == {"rate_hz": None}, "JSON has no NaN"
    assert device.status is defect.status is Status.FAIL
    assert device.measured == "nobody answers at 192.0.2.1"
    assert device.advice == "check the cable"
    assert "ZeroDivisionError" in defect.measured


def test_a_check_that_takes_its_process_down_is_a_row_and_the_rest_is_made():
    crashed, left, fine = run(odd("crash"), odd("leave"), odd("fine"))
    assert crashed.name == "crash" and crashed.status is Status.FAIL
    assert "SIGABRT" in crashed.measured
    assert left.status is Status.FAIL and "exit status 7" in left.measured
    assert fine.status is Status.OK


def test_a_check_that_hangs_is_a_row_and_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    hung, fine = run(odd("hang", limit_s=0.5), odd("fine"))
    assert hung.status is Status.FAIL and "no result within 0.5 s" in hung.measured
    assert fine.status is Status.OK
    assert list(tmp_path.iterdir()) == []


def test_a_stop_ends_the_check_under_way():
    stopped: list[str] = []
    found = run(
        odd("fine"), odd("hang"), on_begin=stopped.append, stop_requested=lambda: "hang" in stopped
    )
    assert [finding.name for finding in found] == ["fine"]


def test_a_worker_ends_with_a_parent_that_is_killed(tmp_path):
    code = (
        "from tests.rig.doctor.test_runner import *\n"
        "for finding in run_checks(SUBJECT, [odd('fine'), odd('hang')], CLOCK):\n"
        "    print(finding.values['pid'], flush=True)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "TMPDIR": str(tmp_path)}
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment
    ) as parent:
        assert parent.stdout is not None
        worker = int(parent.stdout.readline())
        parent.send_signal(signal.SIGKILL)
    deadline_s = CLOCK.now_s() + 60.0
    while Path(f"/proc/{worker}/fd").exists() and _runs(worker):
        assert CLOCK.now_s() < deadline_s, "the worker outlives its parent"
        CLOCK.sleep_until(CLOCK.now_s() + 0.02)


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_subject_and_a_finding_survive_the_way_between_processes():
    assert subject_of(SUBJECT.as_json()) == SUBJECT
    finding = Finding("arm", Status.WARN, "slow", "hurry", {"rate_hz": 3.0, "name": None})
    assert finding_of(finding.as_json()) == finding


def test_a_simulated_rig_has_no_devices_to_check_and_a_real_one_is_no_simulation():
    simulated = {check.name for check in checks_for(SUBJECT)}
    config = RigConfig.model_validate({"arm": {"driver": "ur", "host": "192.0.2.1"}})
    real = {check.name for check in checks_for(Subject(config, Path()))}
    assert simulated ^ real == {"simulated_rig", "calibration", "camera", "arm", "arm_link"}
    assert simulated | real == {check.name for check in CHECKS}


def test_every_check_exists_and_bears_its_name():
    from importlib import import_module

    for check in CHECKS:
        module, _, function = check.entry.partition(":")
        assert callable(getattr(import_module(module), function)), check.name
