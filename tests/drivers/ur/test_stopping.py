"""What counts as an arm that stands still, by its own samples."""

import numpy as np
import pytest

from drivers.errors import ConnectError
from drivers.ur.stopping import stop_arm, why_not_at_rest
from sim_backend.clock import SimulatedClock
from tests.drivers.ur.loopback import free_host
from tests.drivers.ur.samples import sample_at

STOPPED, PLAYING, PAUSED = 1, 2, 4


def samples(runtime_state: int, joint_speed_rad_s: float):
    rng = np.random.default_rng(5)
    times_s = 0.002 * np.arange(100)
    noise = rng.normal(0.0, 2e-5, (100, 6))
    return [
        sample_at(t, runtime_state=runtime_state, q_rad=joint_speed_rad_s * t + q)
        for t, q in zip(times_s, noise, strict=True)
    ]


def test_rest_is_no_program_and_no_moving_joint() -> None:
    assert why_not_at_rest(samples(STOPPED, 0.0)) is None


@pytest.mark.parametrize(
    ("seen", "words"),
    [
        (samples(PLAYING, 0.0), "its program is playing"),
        (samples(PAUSED, 0.0), "its program is paused"),
        (samples(STOPPED, 0.01), "joints move without a program"),
        ([], "reports no state"),
    ],
)
def test_what_is_not_rest_is_named(seen, words) -> None:
    assert words in (why_not_at_rest(seen) or "")


def test_a_controller_that_cannot_be_reached_was_not_stopped() -> None:
    with pytest.raises(ConnectError, match=r"Nothing was stopped.*emergency stop"):
        stop_arm(free_host(), SimulatedClock(0.0))
