"""Registers, program, watchdog and safety of the emulated controller, cycle by cycle."""

import numpy as np
import pytest

from sim_backend.loopback_ur.config import ControllerConfig
from sim_backend.loopback_ur.controller import Controller
from sim_backend.loopback_ur.faults import Faults, fault_kind
from sim_backend.loopback_ur.motion import STEP_S
from sim_backend.loopback_ur.safety import RobotMode, RuntimeState, SafetyMode
from tests.sim_backend.loopback_ur.bench import SCRIPT, Bench


def moving(**config):
    bench = Bench(**config)
    bench.command(10, 0.05, 0, 0, 0, 0, 0, 2.0, 0.002)
    bench.run(0.3)
    assert bench.speed == pytest.approx(0.05, abs=1e-3)
    return bench


def test_a_streaming_command_leaves_the_state_at_ready():
    bench = moving()
    assert bench.state == 1


def test_any_other_command_is_done_and_ready_again_after_zero():
    bench = Bench()
    bench.command(40)
    bench.run(0.004)
    assert bench.state == 2
    bench.command(0)
    bench.run(0.004)
    assert bench.state == 1


def test_speedstop_is_done_only_at_rest():
    bench = moving()
    bench.command(15, 0.5)
    bench.run(0.05)
    assert bench.state == 1 and bench.speed > 0.0
    bench.run(0.3)
    assert bench.state == 2 and bench.speed == 0.0


def test_a_command_is_carried_out_once_however_long_it_stays():
    bench = moving()
    bench.command(33, 2.0)
    bench.run(0.5)
    assert bench.state == 2
    bench.controller.motion.speed_joint(np.full(6, 0.1), 2.0)
    bench.run(0.2)  # 33 is still in the register
    assert bench.speed > 0.0


def test_the_last_speed_goes_on_after_zero_and_without_a_client():
    bench = moving()
    bench.command(0)
    bench.run(0.5)
    assert bench.speed == pytest.approx(0.05, abs=1e-3)
    bench.run(1.0, feed=False)
    assert bench.speed == pytest.approx(0.05, abs=1e-3)


def test_a_silent_command_register_trips_the_watchdog_and_ends_the_program():
    bench = Bench()
    bench.command(35, 10.0)
    bench.run(0.01)
    bench.command(0)
    bench.run(0.01)
    bench.command(10, 0.05, 0, 0, 0, 0, 0, 2.0, 0.002)
    bench.run(0.3)
    bench.run(0.098, feed=False)
    assert bench.controller.runtime is RuntimeState.PLAYING
    bench.run(0.004, feed=False)
    assert bench.controller.runtime is RuntimeState.STOPPED
    bench.run(0.1, feed=False)
    assert bench.speed < 1e-3


def test_the_watchdog_dies_with_its_program():
    bench = Bench()
    bench.command(35, 10.0)
    bench.run(0.01)
    bench.controller.stop_program()
    bench.controller.start_program(SCRIPT)
    bench.command(10, 0.05, 0, 0, 0, 0, 0, 2.0, 0.002)
    bench.run(1.0, feed=False)
    assert bench.speed == pytest.approx(0.05, abs=1e-3)


def test_only_a_script_that_reads_the_command_register_runs():
    controller = Controller(ControllerConfig())
    controller.start_program("def other():\n  popup(1)\nend\n")
    assert controller.runtime is RuntimeState.STOPPED


@pytest.mark.parametrize("how", ["protective_stop", "emergency_stop", "program_stop"])
def test_every_stop_stops_ends_the_program_and_is_reported(how):
    bench = moving()
    faults = Faults(bench.controller)
    faults.order(fault_kind(how), after_s=0.02)
    faults.step()
    assert bench.speed > 0.04
    for _ in range(100):
        bench.run(STEP_S)
        faults.step()
    outputs = bench.controller.outputs()
    assert bench.speed < 1e-6
    assert outputs["runtime_state"] == 1
    bits = outputs["safety_status_bits"]
    assert bool(bits & 1 << 2) == (how == "protective_stop")
    assert bool(bits & 1 << 7) == (how == "emergency_stop")
    assert outputs["robot_mode"] == (3 if how == "emergency_stop" else 7)
    bench.command(10, 0.05, 0, 0, 0, 0, 0, 2.0, 0.002)
    bench.run(0.2)
    assert bench.speed < 1e-6


def test_a_protective_stop_cannot_be_unlocked_in_its_first_seconds():
    bench = moving(unlock_after_s=1.0)
    bench.controller.protective_stop()
    bench.run(0.9)
    assert not bench.controller.unlock_protective_stop()
    bench.run(0.2)
    assert bench.controller.unlock_protective_stop()
    assert bench.controller.safety_mode is SafetyMode.NORMAL


def test_no_program_starts_while_the_arm_may_not_move():
    bench = moving()
    bench.controller.emergency_stop()
    bench.run(0.5)
    bench.controller.release_emergency_stop()
    assert bench.controller.robot_mode is RobotMode.POWER_OFF
    bench.controller.start_program(SCRIPT)
    assert bench.controller.runtime is RuntimeState.STOPPED


def test_a_joint_beyond_its_speed_is_a_protective_stop():
    bench = Bench()
    bench.command(10, 0, 0, 0, 0, 0, 20.0, 150.0, 0.002)
    bench.run(0.5)
    assert bench.controller.safety_mode is SafetyMode.PROTECTIVE_STOP


def test_numbers_that_are_none_do_not_move_the_arm():
    bench = Bench()
    bench.command(10, float("nan"), float("inf"), 0, 0, 0, 0, 2.0, 0.002)
    bench.run(0.1)
    assert bench.speed == 0.0


def test_move_commands_reach_their_goal():
    bench = Bench()
    goal = [float(x) for x in bench.controller.motion.q + 0.1]
    bench.command(1, *goal, 0.5, 2.0)
    bench.run(0.01)
    assert bench.state == 1
    bench.run(1.0)
    assert bench.state == 2
    assert np.allclose(bench.controller.motion.q, goal, atol=1e-6)
    pose = list(bench.controller.outputs()["actual_TCP_pose"])
    pose[2] += 0.02
    bench.command(0)
    bench.run(0.004)
    bench.command(3, *pose, 0.1, 1.0)
    bench.run(1.0)
    assert bench.state == 2
    assert bench.controller.outputs()["actual_TCP_pose"][2] == pytest.approx(pose[2], abs=1e-6)


def test_the_controllers_clock_has_its_own_origin_and_rate():
    controller = Controller(ControllerConfig(timestamp_start_s=77.0, clock_error=1e-3))
    assert controller.timestamp_s == 77.0
    for _ in range(500):
        controller.step()
    assert controller.timestamp_s == pytest.approx(77.0 + 1.001)


def test_unknown_faults_are_named_with_the_known_ones():
    with pytest.raises(ValueError, match="protective_stop, emergency_stop"):
        fault_kind("explosion")


def test_lasting_faults_end_after_their_time():
    controller = Controller(ControllerConfig())
    faults = Faults(controller)
    faults.order("stall", after_s=0.01, for_s=0.02)
    seen = []
    for _ in range(30):
        controller.step()
        faults.step()
        seen.append(faults.stalled)
    assert sum(seen) == 10 and not seen[3] and seen[5] and not seen[-1]


def test_a_cb3_looks_at_its_registers_every_8_ms():
    bench = Bench(version=(3, 15, 8, 0))
    bench.run(0.008)
    bench.command(10, 0.05, 0, 0, 0, 0, 0, 2.0, 0.008)
    bench.run(0.006)
    assert bench.speed == 0.0
    bench.run(0.3)
    assert bench.speed == pytest.approx(0.05, abs=1e-3)
