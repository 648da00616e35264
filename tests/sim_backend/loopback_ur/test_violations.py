"""What the emulated controller does when it is asked for more than the arm can do."""

import numpy as np

from sim_backend.loopback_ur.safety import SafetyMode
from tests.sim_backend.loopback_ur.bench import SCRIPT, Bench


def test_why_it_stopped_is_said_once():
    bench = Bench()
    bench.command(10, 0, 0, 0, 0, 0, 20.0, 150.0, 0.002)
    bench.run(0.5)
    assert bench.controller.take_texts() == [
        "protective stop: a joint would have to go faster than it can"
    ]
    assert bench.controller.take_texts() == []


def test_in_a_singularity_the_arm_is_stopped_and_can_be_led_out_joint_by_joint():
    q = [0.0, -1.2, 0.0, -1.0, 1.5, 0.0]  # the arm stretched out
    bench = Bench(q_start=tuple(q), unlock_after_s=0.0)
    bench.command(10, 0.05, 0, 0, 0, 0, 0, 2.0, 0.002)
    bench.run(0.3)
    assert bench.controller.safety_mode is SafetyMode.PROTECTIVE_STOP
    assert np.abs(bench.controller.motion.q - q).max() < 0.05
    assert bench.controller.unlock_protective_stop()
    bench.controller.start_program(SCRIPT)
    bench.command(9, 0, 0, -0.5, 0, 0, 0, 2.0, 0.002)
    bench.run(1.0)
    assert bench.controller.safety_mode is SafetyMode.NORMAL
    assert bench.controller.motion.q[2] < -0.3
