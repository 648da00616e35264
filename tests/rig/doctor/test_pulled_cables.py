"""Devices that are away or silent: each a failed row that says what to do, and none that hangs."""

import json
import os
import pty
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from drivers.clock import Clock, WallClock
from rig.config_load import load_config, packaged_config
from rig.doctor import devices, link
from rig.doctor.checks import CHECKS
from rig.doctor.finding import Finding, Status
from rig.doctor.subject import Subject
from tests.rig.command_line import rig
from tests.rig.loopback_served import free_host, served

CLOCK = WallClock()
LIMITS_S = {check.name: check.limit_s for check in CHECKS}
NOWHERE = "192.0.2.1"  # an address that nobody has (RFC 5737)


def look(
    check: Callable[[Subject, Clock], Finding], rig_file: str, *settings: str
) -> tuple[Finding, str]:
    """The row, made in time, and all that it says."""
    config = load_config("sphere", packaged_config(rig_file), settings)
    begin_s = CLOCK.now_s()
    found = check(Subject(config, Path("runs"), quick=True), CLOCK)
    assert CLOCK.now_s() - begin_s < LIMITS_S[found.name]
    assert found.status is Status.FAIL
    assert found.advice
    return found, f"{found.measured} | {found.advice}"


@contextmanager
def silent(host: str, *ports: int) -> Iterator[list[int]]:
    """Ports that take connections and never answer; 0: a free one."""
    sockets = [socket.create_server((host, port)) for port in ports]
    yield [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()


def test_a_stream_whose_server_is_away_names_its_address() -> None:
    _, said = look(
        devices.camera, "loopback_ur5e.yaml", "camera.source=http://127.0.0.1:9/stream.mjpg"
    )
    assert "does not answer" in said
    assert "rig camera check --source http://127.0.0.1:9/stream.mjpg" in said


def test_a_stream_that_takes_the_connection_and_stays_silent_ends() -> None:
    with silent("127.0.0.1", 0) as (port,):
        source = f"http://127.0.0.1:{port}/stream.mjpg"
        _, said = look(devices.camera, "loopback_ur5e.yaml", f"camera.source={source}")
    assert "timed out" in said


def test_a_camera_that_is_not_plugged_in_is_looked_for_in_the_list() -> None:
    _, said = look(devices.camera, "ur5e.yaml", "camera.source=/dev/video77")
    assert "/dev/video77" in said and "rig camera list" in said


@pytest.mark.parametrize("check", [devices.arm, link.arm_link])
def test_an_arm_without_power_is_said_to_be_so(
    check: Callable[[Subject, Clock], Finding],
) -> None:
    _, said = look(check, "loopback_ur5e.yaml", f"arm.host={free_host()}")
    assert "check that it is switched on" in said


@pytest.mark.slow
@pytest.mark.parametrize("host", [NOWHERE, "no-such-arm.invalid"])
def test_an_address_that_nobody_has_is_named(host: str) -> None:
    _, said = look(devices.arm, "ur5e.yaml", f"arm.host={host}")
    assert f"no arm controller answers at {host}" in said


def test_a_serial_port_that_is_gone_says_where_ports_are() -> None:
    _, said = look(devices.arm, "gantry.yaml", "arm.port=/dev/serial/by-id/usb-none")
    assert "/dev/serial/by-id" in said and "there is no such port" in said


def test_a_serial_port_that_may_not_be_opened_names_the_group(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*_: object, **__: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("serial.serialposix.os.open", refuse)
    _, said = look(devices.arm, "gantry.yaml", "arm.port=/dev/ttyACM0")
    assert "usermod -aG dialout" in said


@pytest.mark.slow
def test_silent_arms_end(tmp_path: Path) -> None:
    host = free_host()
    with silent(host, 30004, 30003, 29999):
        for check in (devices.arm, link.arm_link):
            _, said = look(check, "loopback_ur5e.yaml", f"arm.host={host}")
            assert "does not speak RTDE as expected: no reply" in said
    master, slave = pty.openpty()
    _, said = look(devices.arm, "gantry.yaml", f"arm.port={os.ttyname(slave)}")
    assert "nothing that speaks Grbl answers" in said
    for one in (master, slave):
        os.close(one)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_camera_unplugged_and_an_arm_in_a_protective_stop_are_rows(tmp_path: Path) -> None:
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    with served("ur", tmp_path, for_s=600.0) as running:
        running.fault("protective_stop")
        running.fault("camera_unplug")
        done = rig(
            *("doctor", "--quick", "--json", "--rig", str(packaged_config("loopback_ur5e.yaml"))),
            *("--set", f"arm.host={running.host}", "--set", f"camera.source={running.stream}"),
            *("--out", str(tmp_path / "runs")),
        )
    assert done.exit_code == 3
    rows = {check["name"]: check for check in json.loads(done.stdout)["checks"]}
    assert rows["camera"]["status"] == rows["arm"]["status"] == "fail"
    assert "rig camera check" in rows["camera"]["advice"]
    assert "protective stop" in rows["arm"]["measured"]
    assert "rig arm recover" in rows["arm"]["advice"]
    assert rows["loop_vision"]["values"]["ticks"] > 100
