"""What the arm says about the errors of its own states."""

import numpy as np
import pytest

from drivers.clock import WallClock
from drivers.ur.noise import noise_at_rest
from tests.drivers.ur.samples import sample_at

pytestmark = pytest.mark.realtime

CLOCK = WallClock()


def samples(count, speed_m_s=0.0, seed=3):
    noise = np.random.default_rng(seed).standard_normal((count, 6)) * ([2e-4] * 3 + [5e-4] * 3)
    moving = np.array([speed_m_s, 0.0, 0.0, 0.0, 0.0, 0.0])
    return [sample_at(0.002 * k, twist_base=moving + noise[k]) for k in range(count)]


def test_the_noise_of_a_resting_arm_is_its_twists_uncertainty():
    std = np.sqrt(np.diag(noise_at_rest(samples(2000))))
    assert std[:3] == pytest.approx(2e-4, rel=0.05)
    assert std[3:] == pytest.approx(5e-4, rel=0.05)


@pytest.mark.parametrize("seen", [samples(10), samples(2000, speed_m_s=0.05), []])
def test_of_too_few_samples_or_a_moving_arm_nothing_is_claimed(seen):
    assert noise_at_rest(seen) is None


def test_states_of_the_arm_carry_uncertainties_that_are_its_own(arm):
    states = []
    while len(states) < 100:
        states += arm.read_states()
        CLOCK.sleep_until(CLOCK.now_s() + 0.02)
    twists = np.array([state.twist_tool for state in states])
    stated = np.sqrt(np.diag(states[-1].twist_covariance))[:3].max()
    assert twists.std(axis=0)[:3].max() < 3.0 * stated
    assert 0.0 < stated < 1e-3
    assert 0.0 < states[-1].t_std_s < 0.01
