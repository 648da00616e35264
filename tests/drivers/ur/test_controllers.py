"""Other controllers, and what a person at the pendant may change while the arm is in use."""

from collections.abc import Iterator

import numpy as np
import pytest

from drivers.clock import WallClock
from drivers.ur.arm import UrArm
from drivers.ur.faults import ProtectiveStopError, TcpChangedError
from drivers.ur.settings import UrSettings
from drivers.ur.status import read_status
from sim_backend.loopback_ur.process import LoopbackProcess
from tests.drivers.ur.loopback import drive, last_motion_s, start_loopback

pytestmark = pytest.mark.realtime

CLOCK = WallClock()
TWIST = np.array([0.04, 0.0, 0.02, 0.0, 0.0, 0.1])


@pytest.fixture(scope="module")
def cb3() -> Iterator[LoopbackProcess]:
    """An old one: not even its TCP can be asked for over RTDE."""
    with start_loopback(version="3.7.0.0") as process:
        yield process


def test_a_cb3_reports_at_125_hz_and_says_nothing_of_remote_control(cb3):
    status = read_status(cb3.host, CLOCK)
    assert status.version == "3.7.0.0"
    assert status.rate_hz == pytest.approx(125.0, rel=0.02)
    assert status.remote_control is None
    assert np.all(np.isnan(status.tcp_offset))
    assert status.problem is None


def test_a_cb3_is_driven_and_stopped_as_any_other(cb3):
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
    arm = UrArm(UrSettings(host=cb3.host, watchdog_hz=5.0, max_state_age_s=0.3), CLOCK)
    try:
        start_s = CLOCK.now_s()
        assert drive(arm, TWIST, 0.2) is None
        arm.read_states()
        assert drive(arm, TWIST, 0.4) is None
        assert np.allclose(arm.tcp_offset(), 0.0)
        arm.stop()
        stopped_s = CLOCK.now_s()
        CLOCK.sleep_until(stopped_s + 0.4)
        states = arm.read_states()
        assert np.median(np.diff([state.t_s for state in states])) == pytest.approx(0.008, rel=0.02)
        assert start_s < last_motion_s(cb3, start_s) < stopped_s + 0.3
    finally:
        arm.close()


def test_the_speed_slider_is_noticed_and_what_is_measured_is_what_the_arm_does(arm, loopback):
    loopback.control.slider(0.5)
    try:
        start_s = CLOCK.now_s()
        assert drive(arm, TWIST, 0.6) is None
        state = arm.read_states()[-1]
        speeds = loopback.control.tool_speeds(start_s)
        true = speeds[np.argmin(np.abs(speeds[:, 0] - state.t_s)), 1:4]
        assert arm.speed_scaling == 0.5
        assert np.linalg.norm(state.twist_tool[:3]) == pytest.approx(
            0.5 * np.linalg.norm(TWIST[:3]), rel=0.03
        )
        assert np.linalg.norm(true) == pytest.approx(0.5 * np.linalg.norm(TWIST[:3]), rel=0.01)
    finally:
        loopback.control.slider(1.0)


def test_another_tcp_on_the_pendant_ends_the_run_because_the_calibration_is_void(arm, loopback):
    assert drive(arm, TWIST, 0.2) is None
    loopback.control.tcp((0.0, 0.0, 0.05, 0.0, 0.0, 0.0))
    try:
        changed_s = CLOCK.now_s()
        error = drive(arm, TWIST, 2.0)
        assert isinstance(error, TcpChangedError)
        assert "0.05000" in str(error) and "no longer holds" in str(error)
        CLOCK.sleep_until(CLOCK.now_s() + 0.5)
        assert last_motion_s(loopback, changed_s) - changed_s < 0.6
    finally:
        loopback.control.tcp((0.0,) * 6)


def test_driven_to_the_end_of_its_reach_the_arm_is_in_a_protective_stop(arm, loopback):
    error = drive(arm, np.array([0.0, -0.25, 0.0, 0.0, 0.0, 0.0]), 6.0)
    assert isinstance(error, ProtectiveStopError)
    stopped_s = CLOCK.now_s()
    CLOCK.sleep_until(stopped_s + 0.3)
    assert last_motion_s(loopback, stopped_s - 0.5) < stopped_s + 0.2
