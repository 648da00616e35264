"""Every fault at random moments of a random motion: what is promised holds in all of them."""

import numpy as np
import pytest

from drivers.errors import OperateError
from drivers.grbl import recovery
from drivers.grbl.session import Session
from sim_backend.loopback_grbl import faults
from sim_backend.loopback_grbl.machine import Machine
from tests.drivers.grbl.simulated import Gantry

SEEDS = range(20)
X = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("fault", "rest_s"),
    [
        ("alarm", 0.02),
        ("emergency_stop", 0.02),
        ("reset", 0.02),
        ("door", 0.15),
        # Nothing can be told to a controller that does not listen: what it has runs out.
        ("stall", 0.30),
    ],
)
def test_the_arm_rests_the_error_is_typed_and_a_recovery_works(
    fault: str, rest_s: float, seed: int
) -> None:
    random = np.random.default_rng([seed, 7])
    gantry = Gantry(Machine(seed=seed, baud=int(random.choice([115200, 1_000_000]))))
    twist = np.concatenate([random.uniform(-0.06, 0.06, 3), random.uniform(-0.4, 0.4, 3)])
    gantry.drive(twist, float(random.uniform(0.02, 1.0)))
    gantry.run(float(random.uniform(0.0, 0.01)))
    begun_s = gantry.clock.now_s()
    faults.inject(gantry.firmware, fault)
    gantry.drive(twist, 0.6)
    assert isinstance(gantry.failure(), OperateError)
    assert str(gantry.failure()).startswith("the gantry on sim ")
    assert gantry.rest_after(begun_s) < rest_s
    faults.clear(gantry.firmware, fault)
    gantry.run(0.2)
    recovery.unlock(gantry.link, gantry.clock, gantry.settings)
    rested_s = gantry.clock.now_s()
    session = Session(gantry.settings, gantry.clock, gantry.link)
    session.run_for(0.3)
    assert session.core.failure is None
    assert not gantry.motion(rested_s)[2].any()


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_a_silent_driver_stops_within_the_hold_time_and_the_stop_table(seed: int) -> None:
    random = np.random.default_rng([seed, 8])
    gantry = Gantry(Machine(seed=seed))
    speed = float(random.uniform(0.01, 0.1))
    gantry.drive(speed * X, float(random.uniform(0.05, 1.0)), hold_s=0.05)
    last_s = gantry.clock.now_s() - 0.01
    # 0.05 s of hold, 35 ms until the cancel takes effect, then braking at 1 m/s².
    assert gantry.rest_after(last_s) < 0.05 + 0.05 + speed
