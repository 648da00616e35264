"""The whole arm over a pty in real time: short runs, wide bounds, exact outcomes.

What it owes as an ``Arm`` is held by ``tests/contract``; here is what is its own.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import WallClock
from drivers.errors import ConnectError, OperateError
from drivers.grbl.arm import GrblArm
from drivers.grbl.errors import AlarmError, HeldError, NotReadyError, PortLostError, SilentError
from drivers.grbl.settings import GrblSettings
from drivers.interfaces import ArmState
from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.server import LoopbackGantry
from tests.drivers.grbl.simulated import CLIENT, settings_for

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
MACHINE = Machine()
X = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture
def gantry(tmp_path: Path) -> Iterator[LoopbackGantry]:
    start = MACHINE.column(MACHINE.joint_zero)
    with LoopbackGantry(MACHINE, start, tmp_path / "gantry", CLOCK) as running:
        yield running


@pytest.fixture
def arm(gantry: LoopbackGantry) -> Iterator[GrblArm]:
    running = GrblArm(settings_of(gantry), CLOCK)
    yield running
    running.close()


def settings_of(gantry: LoopbackGantry) -> GrblSettings:
    """Patient: the emulator shares a busy machine and this process with the driver."""
    return settings_for(MACHINE, port=gantry.port, silence_s=0.6)


def drive(arm: GrblArm, speed_m_s: float, span_s: float) -> list[ArmState]:
    states = []
    next_s = CLOCK.now_s()
    end_s = next_s + span_s
    while next_s < end_s:
        arm.command_twist(speed_m_s * X, 0.1)
        next_s += 0.01
        CLOCK.sleep_until(next_s)
        states += arm.read_states()
    return states


def rest_after(gantry: LoopbackGantry, since_s: float, span_s: float = 0.8) -> float:
    """Seconds from ``since_s`` to the last true motion."""
    CLOCK.sleep_until(since_s + span_s)
    rows = gantry.motion(since_s)
    moving = np.flatnonzero(np.any(rows[:, 7:] != 0.0, axis=1))
    return float(rows[moving[-1], 0] - since_s) if moving.size else 0.0


def fastest_m_s(gantry: LoopbackGantry, since_s: float) -> float:
    """The true speed along x; its greatest, because a busy machine may make the motion pause."""
    return float(gantry.motion(since_s)[:, 7].max())


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        ("alarm", AlarmError),
        ("door", HeldError),
        ("stall", SilentError),
        ("drop", PortLostError),
    ],
)
def test_a_fault_is_typed_ends_in_rest_and_can_be_recovered_from(
    gantry: LoopbackGantry, arm: GrblArm, fault: str, kind: type[OperateError]
) -> None:
    drive(arm, 0.03, 0.3)
    begun_s = CLOCK.now_s()
    gantry.inject(fault)
    with pytest.raises(kind):
        drive(arm, 0.03, 2.0)
    assert CLOCK.now_s() - begun_s < 1.5
    with pytest.raises(kind):
        arm.command_twist(0.03 * X, 0.1)
    assert rest_after(gantry, begun_s, 0.7) < 0.7  # from a stall: what was queued, no more
    gantry.clear(fault)
    with pytest.raises(OperateError, match="not confirmed"):
        arm.recover(lambda text: "Recovering" not in text)
    arm.recover(lambda text: True)
    rested_s = CLOCK.now_s()
    assert rest_after(gantry, rested_s, 0.3) == 0.0
    drive(arm, 0.03, 0.5)
    assert fastest_m_s(gantry, rested_s) > 0.02


@pytest.mark.parametrize("fault", ["door", "emergency_stop"])
def test_a_gantry_found_locked_or_held_opens_says_so_and_is_recovered(
    gantry: LoopbackGantry, fault: str
) -> None:
    gantry.inject(fault)
    arm = GrblArm(settings_of(gantry), CLOCK)
    try:
        with pytest.raises(NotReadyError, match=r"door|emergency stop"):
            arm.read_states()
        with pytest.raises(NotReadyError):
            arm.command_twist(0.03 * X, 0.1)
        arm.stop()
        with pytest.raises(OperateError):
            arm.recover(lambda text: True)  # still open, still pressed
        gantry.clear(fault)
        arm.recover(lambda text: True)
        recovered_s = CLOCK.now_s()
        drive(arm, 0.03, 0.5)
        assert fastest_m_s(gantry, recovered_s) > 0.02
    finally:
        arm.close()


def test_closing_stops_and_ends_everything(gantry: LoopbackGantry) -> None:
    arm = GrblArm(settings_of(gantry), CLOCK)
    drive(arm, 0.03, 0.4)
    arm.close()
    assert not gantry.joints()[1].any()
    arm.close()
    with pytest.raises(OperateError, match="closed"):
        arm.command_twist(0.0 * X, 0.1)
    with pytest.raises(OperateError, match="closed"):
        arm.read_states()
    GrblArm(settings_of(gantry), CLOCK).close()


def test_a_second_user_of_the_port_is_told_so(gantry: LoopbackGantry, arm: GrblArm) -> None:
    with pytest.raises(ConnectError, match="another program uses it"):
        GrblArm(settings_of(gantry), CLOCK)


def test_a_port_that_is_not_there_is_told_so(tmp_path: Path) -> None:
    with pytest.raises(ConnectError, match="no such port: look into /dev/serial/by-id"):
        GrblArm(GrblSettings(port=str(tmp_path / "none")), CLOCK)


def test_without_pyserial_the_cure_is_one_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(ConnectError, match="pip install pyserial"):
        GrblArm(GrblSettings(port="/dev/null"), CLOCK)


def test_only_the_port_has_to_be_given(gantry: LoopbackGantry) -> None:
    arm = GrblArm(GrblSettings(port=gantry.port, silence_s=0.6), CLOCK)
    try:
        assert arm.controller.letters == tuple("XYZABC")
    finally:
        arm.close()


def test_a_killed_client_leaves_no_more_than_the_queue(gantry: LoopbackGantry) -> None:
    """SIGKILL: the controller has no watchdog, so what was sent runs on and no further."""
    client = subprocess.Popen(
        [sys.executable, "-c", CLIENT, gantry.port], stdout=subprocess.PIPE, text=True
    )
    try:
        assert client.stdout is not None
        assert client.stdout.readline() == "moving\n"
        client.kill()
        killed_s = CLOCK.now_s()
        client.wait()
    finally:
        client.kill()
        client.wait()
        if client.stdout is not None:
            client.stdout.close()
    assert gantry.joints()[1].any()
    assert 0.03 < rest_after(gantry, killed_s) < 0.40
