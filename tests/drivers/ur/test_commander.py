"""What goes out to the controller, decided on given instants."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.ur.commander import Commander
from drivers.ur.settings import UrSettings
from tests.drivers.ur.samples import sample_at

SETTINGS = UrSettings(host="arm")
TWIST = np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.1])


def commanding(until_s: float = 10.05) -> Commander:
    commander = Commander(SETTINGS)
    commander.command(TWIST, until_s)
    return commander


def test_nothing_moves_before_a_motion_was_asked_for():
    commander = Commander(SETTINGS)
    assert commander.output(10.0, sample_at(10.0)) is None
    commander.command(np.zeros(6), 10.05)
    assert commander.output(10.0, sample_at(10.0)) is None


def test_the_tool_twist_is_turned_into_base_axes_by_the_newest_orientation():
    commander = commanding()
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec([0.0, 0.0, np.pi / 2]).as_matrix()
    speed = commander.output(10.0, sample_at(10.0, T_base_tool=T))
    assert np.allclose(speed.twist_base, [0.0, 0.05, 0.0, 0.0, 0.0, 0.1])
    assert speed.acceleration_m_s2 == SETTINGS.acceleration_m_s2


def test_a_command_acts_for_its_hold_time_and_then_brakes_for_good():
    commander = commanding(until_s=10.05)
    assert np.any(commander.output(10.049, sample_at(10.049)).twist_base)
    braking = commander.output(10.05, sample_at(10.05))
    assert not np.any(braking.twist_base)
    assert braking.acceleration_m_s2 == SETTINGS.stop_acceleration_m_s2
    assert not np.any(commander.output(20.0, sample_at(20.0)).twist_base)


def test_stop_brakes_at_once_and_a_new_command_moves_again():
    commander = commanding()
    commander.output(10.0, sample_at(10.0))
    commander.stop()
    assert not np.any(commander.output(10.001, sample_at(10.001)).twist_base)
    commander.command(TWIST, 10.1)
    assert np.any(commander.output(10.002, sample_at(10.002)).twist_base)


@pytest.mark.parametrize(
    "changes",
    [
        {"safety_status_bits": 1 << 2},
        {"safety_status_bits": 1 << 7},
        {"robot_mode": 3},
        {"runtime_state": 1},
        {"runtime_state": 4},
    ],
)
def test_a_fault_brakes_and_the_cut_command_never_resumes(changes):
    commander = commanding(until_s=10.5)
    assert np.any(commander.output(10.0, sample_at(10.0)).twist_base)
    assert not np.any(commander.output(10.01, sample_at(10.01, **changes)).twist_base)
    assert not np.any(commander.output(10.02, sample_at(10.02)).twist_base)


def test_an_old_or_missing_state_brakes():
    commander = commanding(until_s=11.0)
    sample = sample_at(10.0)
    assert np.any(commander.output(10.0, sample).twist_base)
    assert not np.any(commander.output(10.0 + 1.01 * SETTINGS.max_state_age_s, sample).twist_base)
    assert commanding().output(10.0, None) is None
