"""How measured figures of devices, links, loops and disks become rows."""

import numpy as np
import pytest

from drivers.clock import WallClock
from rig.config import RigConfig
from rig.doctor.devices import address_of, calibration, judge_arm, judge_camera
from rig.doctor.disk import DiskFacts, disk, existing_parent, judge_disk
from rig.doctor.finding import Finding, Status
from rig.doctor.lateness import LoopFacts, judge_loop, judge_vision
from rig.doctor.link import NetworkFacts, judge_network
from rig.doctor.packages import EXTRAS, judge_packages, needed_by, state_of
from rig.doctor.simulation import judge_renderer, judge_simulation
from rig.doctor.subject import Subject
from rig.doctor.table import sum_up, table_of

MS = 1e-3


def advised(finding: Finding, status: Status) -> None:
    """The status is as told, and only what is not well comes with advice."""
    assert finding.status is status, finding
    assert bool(finding.advice) is (status is not Status.OK), finding
    assert "\n" not in finding.advice


def loop(*late_s: float, overruns: int = 0) -> LoopFacts:
    return LoopFacts(np.array(late_s), overruns, period_s=0.010, hold_s=0.050, scheduling="normal")


@pytest.mark.parametrize(
    ("facts", "status"),
    [
        (loop(*[0.1 * MS] * 1000), Status.OK),
        (loop(*[0.1 * MS] * 900, *[3 * MS] * 100), Status.WARN),
        (loop(*[0.1 * MS] * 1999, 45 * MS, overruns=4), Status.WARN),
        (loop(*[0.1 * MS] * 900, *[45 * MS] * 100, overruns=400), Status.FAIL),
    ],
)
def test_a_loop_fails_where_the_arm_would_brake_between_two_commands(facts, status):
    advised(judge_loop("loop_idle", facts, ""), status)


def test_pictures_have_to_be_measured_as_fast_as_they_come():
    punctual = loop(*[0.1 * MS] * 1000)
    advised(judge_vision(punctual, 29.9, 0), Status.OK)
    advised(judge_vision(punctual, 12.0, 0), Status.WARN)
    assert judge_vision(punctual, 12.0, 3).values["pictures_lost"] == 3


def network(connect_s=0.2 * MS, gap_s=2 * MS, longest_s=3 * MS, states=1500, lasted_s=3.0):
    gaps_s = np.array([gap_s] * 999 + [longest_s])
    dashboard_s = np.full(50, 5 * MS)
    return NetworkFacts(np.full(10, connect_s), dashboard_s, gaps_s, states, lasted_s, 500.0)


@pytest.mark.parametrize(
    ("facts", "status"),
    [
        (network(), Status.OK),
        (network(connect_s=8 * MS), Status.WARN),
        (network(states=1400), Status.WARN),
        (network(longest_s=60 * MS), Status.WARN),
        (network(longest_s=90 * MS), Status.FAIL),
        (network(lasted_s=0.0), Status.FAIL),
    ],
)
def test_a_network_fails_where_a_run_would_see_a_stall(facts, status):
    advised(judge_network(facts, max_state_age_s=0.08), status)


def test_a_controller_without_a_dashboard_is_measured_all_the_same():
    whole = network()
    facts = NetworkFacts(
        whole.connect_s, np.array([]), whole.gaps_s, whole.states, whole.lasted_s, 500.0
    )
    finding = judge_network(facts, 0.08)
    assert finding.values["dashboard_median_s"] is None and "no dashboard" in finding.measured


def camera_figures(**changes):
    figures = {
        "width": 640, "height": 480, "fourcc": "MJPG", "measured_fps": 30.01,
        "stamp_source": "kernel", "stamp_jitter_s": 1e-4, "latency_median_s": 0.03,
        "latency_p99_s": 0.04, "longest_gap_s": 0.034, "frames": 150, "dropped": 0, "corrupt": 0,
        "warnings": [], "problem": None,
    }  # fmt: skip
    return figures | changes


@pytest.mark.parametrize(
    ("changes", "status"),
    [
        ({}, Status.OK),
        ({"latency_median_s": None, "measured_fps": None}, Status.OK),
        ({"dropped": 30}, Status.WARN),
        ({"warnings": ["rate 30 fps requested, got 25"]}, Status.WARN),
        ({"problem": "no frame for 2.00 s"}, Status.FAIL),
    ],
)
def test_a_camera_is_judged_by_what_it_delivered(changes, status):
    advised(judge_camera(camera_figures(**changes), "/dev/video0"), status)


GANTRY = {
    "controller": "/dev/ttyACM0", "state": "The gantry is ready.", "problem": None,
    "round_trip_s": 0.007, "command_delay_s": 0.14, "bandwidth_hz": 0.9,
}  # fmt: skip
UR = {"controller": "UR5 5.15", "safety": "normal", "mode": "running", "problem": None}


@pytest.mark.parametrize(
    ("facts", "status", "words"),
    [
        (UR | {"remote_control": True, "speed_scaling": 1.0}, Status.OK, "normal"),
        (UR | {"remote_control": False, "speed_scaling": 1.0}, Status.WARN, "local control"),
        (UR | {"remote_control": True, "speed_scaling": 0.5}, Status.WARN, "50 %"),
        (UR | {"unguarded": "joint ends are not guarded"}, Status.WARN, "joint ends are not"),
        (UR | {"problem": "the arm is in a protective stop"}, Status.FAIL, "protective stop"),
        (GANTRY, Status.OK, "commands act after 140 ms"),
    ],
)
def test_an_arm_that_cannot_move_fails_and_says_how_to_bring_it_back(facts, status, words):
    finding = judge_arm(facts, "--arm ur --host 192.0.2.1")
    advised(finding, status)
    assert words in finding.measured
    assert (status is Status.FAIL) is ("rig arm recover --arm ur" in finding.advice)


def rig_config(**sections) -> RigConfig:
    return RigConfig.model_validate(sections)


def test_an_arms_address_is_the_configured_one():
    ur = rig_config(arm={"driver": "ur", "host": "192.0.2.1"})
    gantry = rig_config(arm={"driver": "grbl", "port": "/dev/ttyACM0", "baud": 9600})
    assert address_of(RigConfig()) is None
    address = address_of(ur)
    assert address is not None and address.host == "192.0.2.1"
    address = address_of(gantry)
    assert address is not None and (address.port, address.baud) == ("/dev/ttyACM0", 9600)


def test_a_missing_calibration_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # its file is looked for here
    arm = {"driver": "ur", "host": "192.0.2.1"}
    real = {"arm": arm, "camera": {"driver": "opencv", "source": "/dev/video7"}}
    missing = calibration(Subject(rig_config(**real), tmp_path), WallClock())
    advised(missing, Status.WARN)
    assert "not calibrated" in missing.measured and "rig calibrate --rig" in missing.advice
    given = {
        "obtained": "on an optical bench",
        "intrinsics": {"fx_px": 800, "fy_px": 800, "cx_px": 320, "cy_px": 240},
        "tool_camera_xyz_m": [0, 0, 0],
        "tool_camera_rotvec_rad": [0, 0, 0],
    }
    whole = calibration(Subject(rig_config(**real, calibration=given), tmp_path), WallClock())
    advised(whole, Status.OK)
    gone = rig_config(**real, calibration={"file": "no/such.yaml"})
    advised(calibration(Subject(gone, tmp_path), WallClock()), Status.FAIL)


@pytest.mark.parametrize(
    ("speed_bytes_s", "longest_s", "free_bytes", "status"),
    [
        (500e6, 0.1 * MS, 70e9, Status.OK),
        (500e6, 500 * MS, 70e9, Status.WARN),
        (2e6, 0.1 * MS, 70e9, Status.WARN),
        (500e6, 0.1 * MS, 1e9, Status.WARN),
        (0.3e6, 0.1 * MS, 70e9, Status.FAIL),
        (500e6, 0.1 * MS, 1e6, Status.FAIL),
    ],
)
def test_a_disk_is_judged_by_what_a_runs_log_needs(
    speed_bytes_s, longest_s, free_bytes, status, tmp_path
):
    advised(judge_disk(DiskFacts(tmp_path, speed_bytes_s, longest_s, int(free_bytes))), status)


def test_the_disk_is_measured_where_runs_will_be_and_nothing_stays_there(tmp_path):
    finding = disk(Subject(RigConfig(), tmp_path / "not/yet/runs", quick=True), WallClock())
    assert finding.status in (Status.OK, Status.WARN)
    assert finding.values["folder"] == str(tmp_path)
    assert float(finding.values["speed_bytes_s"] or 0) > 0
    assert list(tmp_path.iterdir()) == []


def test_where_nothing_can_be_written_is_a_failure():
    assert str(existing_parent(subject_in_proc().runs)) == "/proc"
    advised(disk(subject_in_proc(), WallClock()), Status.FAIL)


def subject_in_proc() -> Subject:
    from pathlib import Path

    return Subject(RigConfig(), Path("/proc/activerig-runs"), quick=True)


ALL = {extra.distribution: "1.0" for extra in EXTRAS}


@pytest.mark.parametrize(
    ("states", "needed", "status", "words"),
    [
        (ALL, {"ur-rtde"}, Status.OK, ""),
        (ALL | {"ur-rtde": None}, set(), Status.OK, ""),
        (ALL | {"ur-rtde": None}, {"ur-rtde"}, Status.FAIL, "pip install 'ur-rtde"),
        (ALL | {"ur-rtde": "!libboost is missing"}, set(), Status.WARN, "pip install 'ur-rtde"),
        (ALL | {"linuxpy": None}, {"linuxpy"}, Status.WARN, "pip install 'linuxpy"),
        (ALL | {"linuxpy": None, "ur-rtde": None}, {"linuxpy", "ur-rtde"}, Status.FAIL, "ur-rtde"),
    ],
)
def test_a_package_fails_only_a_rig_that_needs_it(states, needed, status, words):
    finding = judge_packages(states, needed)
    advised(finding, status)
    assert words in finding.advice


def test_drivers_name_the_packages_they_use():
    camera = {"driver": "opencv", "source": "/dev/video0"}
    assert needed_by(RigConfig()) == set()
    ur = rig_config(arm={"driver": "ur", "host": "192.0.2.1"}, camera=camera)
    assert needed_by(ur) == {"ur-rtde", "linuxpy"}
    stream = {"driver": "opencv", "source": "http://192.0.2.2/stream"}
    gantry = rig_config(arm={"driver": "grbl", "port": "/dev/ttyACM0"}, camera=stream)
    assert needed_by(gantry) == {"pyserial"}
    nowhere = rig_config(camera={"driver": "opencv", "source": "no/such/file"})
    assert needed_by(nowhere) == set()


def test_a_package_is_absent_broken_or_there():
    from importlib.metadata import PackageNotFoundError

    extra = EXTRAS[0]

    def absent(name: str) -> str:
        raise PackageNotFoundError(name)

    def broken(name: str) -> object:
        raise ImportError("libboost is missing")

    assert state_of(extra, lambda name: None, absent) is None
    assert state_of(extra, broken, lambda name: "3.5") == "!libboost is missing"
    assert state_of(extra, lambda name: None, lambda name: "3.5") == "3.5"


def test_a_machine_without_opengl_is_well():
    advised(judge_renderer("auto", "raster", "egl: no library"), Status.OK)
    advised(judge_renderer("auto", "gl", ""), Status.OK)


def test_a_simulation_that_shows_no_ball_fails():
    advised(judge_simulation("raster", "", 3e-3), Status.OK)
    advised(judge_simulation("raster", "nothing round in the image", 3e-3), Status.FAIL)


@pytest.mark.parametrize("width", [80, 120])
def test_the_table_keeps_every_word_whatever_the_width(width):
    from rich.console import Console

    long = "sudo tee /etc/udev/rules.d/70-activerig.rules"
    findings = [
        Finding("kernel", Status.OK, "Linux [6.1]"),
        Finding("loop_idle", Status.WARN, "late " * 40, long),
        Finding("arm", Status.FAIL, "gone", "x" * 200),
    ]
    console = Console(width=width, record=True, file=None, force_terminal=False)
    with console.capture() as captured:
        console.print(table_of(findings))
    text = captured.get()
    assert all(len(line) <= width for line in text.splitlines())
    assert "Linux [6.1]" in text and "loop idle" in text and text.count("late") == 40
    assert "".join(text.split()).count("x") >= 200
    assert long.replace(" ", "") in "".join(text.split())
    assert sum_up(findings) == "not ready: 1 ok, 1 warn, 1 fail"
    assert sum_up(findings[:1], interrupted=True).startswith("interrupted")
    assert sum_up(findings[:2]).startswith("usable") and sum_up(findings[:1]).startswith("ready")
