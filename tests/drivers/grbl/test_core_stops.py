"""Stopping, and what is refused: the driver's core against the emulated controller."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.grbl.errors import LimitError, MotionError
from sim_backend.loopback_grbl.machine import Machine
from tests.drivers.grbl.simulated import Gantry

UART = Machine(clock_rate=1.0)
USB = Machine(clock_rate=1.0, baud=1_000_000)
THREE = Machine(clock_rate=1.0, axes=3)
PLAIN = Machine(clock_rate=1.0, axes=3, flavour="Grbl")
ALL = pytest.mark.parametrize(
    "machine", [UART, USB, THREE, PLAIN], ids=lambda m: f"{m.flavour}-{m.axes}-{m.baud}"
)

X = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


@ALL
def test_stop_takes_the_time_of_the_stop_table(machine: Machine) -> None:
    gantry = Gantry(machine)
    gantry.drive(0.05 * X, 0.8)
    begun_s = gantry.clock.now_s()
    gantry.core.stop()
    assert gantry.rest_after(begun_s) < 0.10
    assert gantry.core.settled


@ALL
def test_an_old_command_is_cancelled_not_run_out(machine: Machine) -> None:
    gantry = Gantry(machine)
    gantry.drive(0.05 * X, 0.8, hold_s=0.05)
    last_s = gantry.clock.now_s() - 0.010
    assert gantry.rest_after(last_s) < 0.05 + 0.10
    assert gantry.core.failure is None


def test_a_zero_command_comes_to_rest_without_a_cancel() -> None:
    gantry = Gantry(UART)
    gantry.drive(0.05 * X, 0.8)
    begun_s = gantry.clock.now_s()
    gantry.drive(0.0 * X, 0.6)
    assert gantry.rest_after(begun_s, 0.1) < 0.25


def test_after_a_stop_it_starts_again_from_where_it_is() -> None:
    gantry = Gantry(UART)
    for direction in (1.0, -1.0, 1.0):
        gantry.drive(direction * 0.05 * X, 0.6)
        gantry.core.stop()
        gantry.run(0.4)
        before = gantry.q()[0]
        gantry.run(0.3)
        assert gantry.q()[0] == before  # nothing from before the stop comes back
    assert gantry.core.failure is None


def test_a_command_during_a_stop_waits_for_rest() -> None:
    gantry = Gantry(UART)
    gantry.drive(0.05 * X, 0.6)
    gantry.core.stop()
    gantry.drive(-0.05 * X, 0.8)
    assert gantry.core.failure is None
    assert gantry.firmware.joints()[1][0, 0] == pytest.approx(-0.05, rel=0.02)


def test_an_axis_slows_down_and_stops_at_the_end_of_its_range() -> None:
    q = np.zeros(6)
    q[0] = 0.75  # 50 mm before the end
    gantry = Gantry(UART, q)
    with pytest.raises(LimitError, match=r"X \(x\) is at the end"):
        gantry.drive(0.05 * X, 4.0)
    gantry.run(0.5)
    assert not gantry.moving()
    assert 0.79 < gantry.q()[0] <= 0.8
    gantry.drive(-0.05 * X, 0.6)  # away from it is allowed
    assert gantry.core.failure is None
    assert gantry.q()[0] < 0.79


def test_three_axes_refuse_a_rotation_and_rest() -> None:
    gantry = Gantry(THREE)
    gantry.drive(0.03 * X, 0.5)
    begun_s = gantry.clock.now_s()
    with pytest.raises(MotionError, match=r"no axis for a rotation of 0\.2 rad/s"):
        gantry.core.command(np.array([0.03, 0, 0, 0, 0.2, 0]), 0.05, begun_s)
    assert gantry.rest_after(begun_s) < 0.10


def test_three_axes_can_be_told_to_leave_rotations_out() -> None:
    gantry = Gantry(THREE, on_rotation="drop")
    gantry.drive(np.array([0.03, 0, 0, 0, 0.2, 0]), 0.6)
    assert gantry.firmware.joints()[1][0] == pytest.approx([0.03, 0, 0, 0, 0, 0], abs=1e-4)


@pytest.mark.parametrize("twist", [np.full(6, np.nan), np.zeros(3), np.full(6, np.inf)])
def test_what_is_no_twist_stops_the_arm(twist: np.ndarray) -> None:
    gantry = Gantry(UART)
    gantry.drive(0.03 * X, 0.5)
    begun_s = gantry.clock.now_s()
    with pytest.raises(MotionError, match="six finite numbers"):
        gantry.core.command(twist, 0.05, begun_s)
    assert gantry.rest_after(begun_s) < 0.10


@settings(max_examples=15, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.lists(st.floats(-0.08, 0.08), min_size=6, max_size=6),
            st.sampled_from([0.01, 0.05, 0.2]),
            st.booleans(),
        ),
        min_size=1,
        max_size=12,
    )
)
def test_whatever_is_commanded_it_rests_soon_after(
    commands: list[tuple[list[float], float, bool]],
) -> None:
    gantry = Gantry(UART)
    for twist, span_s, stop in commands:
        gantry.drive(np.array(twist), span_s)
        if stop:
            gantry.core.stop()
    last_s = gantry.clock.now_s()
    assert gantry.rest_after(last_s) < 0.05 + 0.20  # 130 mm/s need 130 ms to brake
    assert gantry.core.failure is None
    status = gantry.core.status
    assert status is not None
    assert status.state == "Idle"
