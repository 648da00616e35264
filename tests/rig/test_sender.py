"""What reaches the arm after the program was held up: nothing that was decided before."""

import numpy as np
import pytest

from rig.config_safety import SafetyConfig
from rig.envelope import Surroundings
from rig.safety import Limiter
from rig.sender import HELD_UP, Sender
from sim_backend.clock import SimulatedClock
from tests.rig.fakes import KinematicArm

HOLD_S = 0.05
TICK_S = 0.01
WANTED = np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.2])


class Rig:
    def __init__(self) -> None:
        self.clock = SimulatedClock()
        self.arm = KinematicArm(self.clock)
        self.sender = Sender(self.arm, self.clock, Limiter(SafetyConfig()), HOLD_S, None)
        self.clock.sleep_until(0.1)
        self.arm.read_states()

    def tick(self, hang_s: float = 0.0):
        """One tick: measure, be held up while deciding, send."""
        self.clock.sleep_until(self.clock.now_s() + TICK_S)
        now_s = self.clock.now_s()
        self.arm.read_states()
        around = Surroundings(self.arm.history[-1])
        self.clock.sleep_until(now_s + hang_s)
        return self.sender.send(WANTED, around, now_s, TICK_S)


def moving() -> Rig:
    rig = Rig()
    for _ in range(100):
        rig.tick()
    assert np.allclose(rig.arm.commands[-1][1], WANTED)
    return rig


def test_what_was_decided_before_a_hang_is_not_sent_after_it():
    rig = moving()
    allowed = rig.tick(hang_s=0.5)
    assert not np.any(rig.arm.commands[-1][1])
    assert not np.any(allowed.twist_tool) and HELD_UP in allowed.reasons


@pytest.mark.parametrize("within_a_tick", [True, False])
def test_the_motion_ramps_up_from_rest_after_a_hang(within_a_tick: bool):
    rig = moving()
    if within_a_tick:
        rig.tick(hang_s=0.5)
    else:
        rig.clock.sleep_until(rig.clock.now_s() + 0.5)
    before = len(rig.arm.commands)
    for _ in range(100):
        rig.tick()
    speeds = np.array([np.linalg.norm(twist[:3]) for _, twist in rig.arm.commands[before:]])
    most = SafetyConfig().max_linear_acceleration_m_s2 * TICK_S
    assert speeds[0] <= most * (1 + 1e-9)
    assert np.all(np.diff(speeds) <= most * (1 + 1e-9))
    assert speeds[-1] == pytest.approx(np.linalg.norm(WANTED[:3]))


def test_a_tick_a_little_late_is_no_hang():
    rig = moving()
    allowed = rig.tick(hang_s=0.8 * HOLD_S)
    assert np.allclose(allowed.twist_tool, WANTED)
