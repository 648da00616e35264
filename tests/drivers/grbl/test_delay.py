"""The delay from command to motion, measured in passing on a motion that somebody wants."""

import numpy as np
import pytest

from sim_backend.loopback_grbl.machine import Machine
from tests.drivers.grbl.simulated import TICK_S, Gantry

UART = Machine()
THREE = Machine(flavour="Grbl", axes=3)
AHEAD = np.array([0.6, 0.8, 0.0, 0.0, 0.0, 0.0])


def ramp(gantry: Gantry, speed_m_s: float, ramp_s: float, span_s: float = 1.2) -> float:
    """Drive from rest; the instant at which half the speed was commanded."""
    begun_s = gantry.clock.now_s()
    while (passed_s := gantry.clock.now_s() - begun_s) < span_s:
        share = min(1.0, (passed_s + TICK_S) / ramp_s)
        gantry.core.command(share * speed_m_s * AHEAD, 0.05, gantry.clock.now_s())
        gantry.run(TICK_S)
    return begun_s + 0.5 * ramp_s


@pytest.mark.parametrize("machine", [UART, THREE], ids=["grblHAL", "Grbl"])
@pytest.mark.parametrize(("speed_m_s", "ramp_s"), [(0.02, 0.06), (0.05, 0.1), (0.1, 0.2)])
def test_the_first_motion_from_rest_shows_it(
    machine: Machine, speed_m_s: float, ramp_s: float
) -> None:
    gantry = Gantry(machine)
    assert not gantry.session.timing.command_delay_measured
    half_s = ramp(gantry, speed_m_s, ramp_s)
    t, _, qd = gantry.motion(half_s - ramp_s)
    fast = np.linalg.norm(qd[:, :2], axis=1) > 0.5 * speed_m_s
    timing = gantry.session.timing
    assert timing.command_delay_measured
    assert timing.command_delay_s == pytest.approx(t[np.argmax(fast)] - half_s, abs=0.020)
    assert 0.002 < timing.command_delay_std_s < 0.02


def test_a_step_from_rest_shows_nothing_since_the_queue_is_empty() -> None:
    gantry = Gantry(UART)
    gantry.drive(0.03 * AHEAD, 1.2)
    assert not gantry.session.timing.command_delay_measured


def test_a_motion_too_short_to_be_steady_shows_nothing_and_the_next_one_does() -> None:
    gantry = Gantry(UART)
    ramp(gantry, 0.05, 0.1, span_s=0.3)
    gantry.core.stop()
    gantry.run(0.8)
    assert not gantry.session.timing.command_delay_measured
    ramp(gantry, 0.05, 0.1)
    assert gantry.session.timing.command_delay_measured


def test_a_motion_held_back_by_the_axes_is_not_mistaken_for_a_late_one() -> None:
    slow = Machine(max_rate=(1200.0,) * 6)  # 20 mm/s
    gantry = Gantry(slow)
    ramp(gantry, 0.05, 0.1)
    assert not gantry.session.timing.command_delay_measured
