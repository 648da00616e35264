"""``rig doctor`` as a person types it."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from drivers.clock import WallClock
from rig.config_load import packaged_config
from rig.doctor.checks import CHECKS, Check
from tests.rig.command_line import rig

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
QUICKEST = ("kernel", "memory", "disk", "serial_nodes")
ODD = "tests.rig.doctor.odd_checks:"


@pytest.fixture
def few(monkeypatch):
    """Only checks that take no time."""
    monkeypatch.setattr("rig.doctor.checks.CHECKS", [c for c in CHECKS if c.name in QUICKEST])


def test_json_is_one_object_with_a_row_per_check(few, tmp_path):
    result = rig("doctor", "--quick", "--json", "--out", str(tmp_path / "runs"))
    report = json.loads(result.stdout)
    assert result.exit_code == 0 and report["ok"] is True and report["interrupted"] is False
    assert [check["name"] for check in report["checks"]] == list(QUICKEST)
    for check in report["checks"]:
        assert set(check) == {"name", "status", "measured", "advice", "values"}
        assert check["status"] in ("ok", "warn") and check["measured"]
    assert "kernel" in result.stderr, "the table goes to standard error"
    assert not (tmp_path / "runs").exists()


def test_a_failed_check_is_exit_status_3_and_the_others_are_shown(monkeypatch):
    checks = [
        Check("device_error", ODD + "device_error", 120.0),
        Check("fine", ODD + "fine", 120.0),
    ]
    monkeypatch.setattr("rig.doctor.checks.CHECKS", checks)
    result = rig("doctor")
    assert result.exit_code == 3
    assert "check the cable" in result.stdout
    assert "not ready: 1 ok, 0 warn, 1 fail" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--rig", "no/such.yaml"], "no/such.yaml"),
        (["--set", "arm.hots=1"], "hots"),
        (["configs/ur5e.yaml"], "--rig configs/ur5e.yaml"),
        (["--write-udev", "no/such/folder/70-rig.rules"], "sudo tee"),
        (["--nonsense"], "--nonsense"),
    ],
)
def test_wrong_usage_is_exit_status_2_and_says_why(arguments, words):
    result = rig("doctor", *arguments)
    assert result.exit_code == 2
    assert words in result.stderr and not result.stdout


def test_udev_rules_are_printed_or_written_and_nothing_is_checked(tmp_path):
    printed = rig("doctor", "--write-udev")
    assert printed.exit_code == 0 and 'TAG+="uaccess"' in printed.stdout
    assert rig("doctor", "--write-udev", "-").stdout == printed.stdout
    written = rig("doctor", "--write-udev", str(tmp_path / "70-rig.rules"))
    assert written.exit_code == 0 and "udevadm control --reload" in written.stderr
    assert (tmp_path / "70-rig.rules").read_text() == printed.stdout


def test_ctrl_c_ends_at_once_with_the_rows_made_so_far(tmp_path):
    code = f"""
import sys, rig.doctor.checks as checks
from rig.cli import main
checks.CHECKS = [checks.Check(n, "{ODD}" + n, 500.0) for n in ("fine", "hang", "fine")]
sys.argv[0] = "rig"
main()
"""
    (tmp_path / "temporary").mkdir()
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(sys.path),
        "TMPDIR": str(tmp_path / "temporary"),
    }
    hanging = tmp_path / "hanging"
    with subprocess.Popen(
        [sys.executable, "-c", code, "doctor", "--json", "--out", str(hanging)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
        start_new_session=True,
    ) as process:
        deadline_s = CLOCK.now_s() + 180.0
        while not hanging.exists():
            assert process.poll() is None and CLOCK.now_s() < deadline_s
            CLOCK.sleep_until(CLOCK.now_s() + 0.05)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does it: to the whole group
        output, _ = process.communicate(timeout=30.0)
    report = json.loads(output)
    assert process.returncode == 130
    assert report["interrupted"] is True and report["ok"] is False
    assert [check["name"] for check in report["checks"]] == ["fine"]
    assert list((tmp_path / "temporary").iterdir()) == []


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_every_check_of_the_machine_and_the_simulated_rig(tmp_path):
    result = rig("doctor", "--quick", "--json", "--out", str(tmp_path))
    report = {check["name"]: check for check in json.loads(result.stdout)["checks"]}
    assert report["simulated_rig"]["status"] == "ok"
    assert report["loop_vision"]["values"]["ticks"] > 150
    assert report["loop_vision"]["values"]["pictures_lost"] == 0


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_devices_that_are_not_there_are_rows(tmp_path):
    result = rig(
        *("doctor", "--quick", "--json", "--rig", str(packaged_config("gantry.yaml"))),
        *("--out", str(tmp_path)),
    )
    report = {check["name"]: check for check in json.loads(result.stdout)["checks"]}
    assert result.exit_code == 3
    assert "no camera is connected" in report["camera"]["measured"]
    assert "no such port" in report["arm"]["measured"]
    assert "arm_link" not in report, "a serial line has no network"


def test_help_names_the_exit_codes_and_the_places(tmp_path: Path):
    text = " ".join(rig("doctor", "--help").stdout.split())
    for words in ("--write-udev", "[FILE|-]", "3 a check failed", "Nothing moves"):
        assert words in text
