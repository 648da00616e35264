"""Figures of the UR driver against the loopback controller, in real time on this machine.

Run with ``python -m benchmarks.bench_ur [--seeds 20]``. Motion is measured twice: at the client by
the states it receives, and at the controller by the joints' true positions.
"""

import argparse
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.clock import WallClock
from drivers.errors import RigError
from drivers.interfaces import ArmState
from drivers.ur.arm import UrArm
from drivers.ur.recovery import recover_controller
from drivers.ur.settings import UrSettings
from sim_backend.loopback_ur.process import LoopbackProcess

FloatArray = NDArray[np.float64]

HOST = "127.0.0.41"
CLOCK = WallClock()
HOLD_S = 0.05
SPEED_M_S = 0.05
FAULTS = ("protective_stop", "emergency_stop", "program_stop", "drop", "stall")


def main() -> None:
    """Print all figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    seeds = parser.parse_args().seeds
    with LoopbackProcess(HOST, lifetime_s=1800.0, unlock_after_s=0.3) as loopback:
        arm = UrArm(UrSettings(host=HOST), CLOCK)
        steps_and_rate(arm, loopback, seeds)
        for fault in FAULTS:
            report(f"{fault}", *fault_times(arm, loopback, fault, seeds))
        arm.close()
        for name, kill in KILLS.items():
            times = [kill_time(loopback, kill) for _ in range(max(3, seeds // 4))]
            line(f"{name}: moved on at the controller", times)


def steps_and_rate(arm: UrArm, loopback: LoopbackProcess, seeds: int) -> None:
    """Latency of a step, TCP speed error, state rate and age."""
    rng = np.random.default_rng(1)
    at_client: list[float] = []
    at_controller: list[float] = []
    errors: list[float] = []
    ages: list[float] = []
    states: list[ArmState] = []
    start_s, start_cpu_s = CLOCK.now_s(), cpu_s(loopback.pid)
    for k in range(5 * seeds):
        direction = rng.standard_normal(6) * [1, 1, 1, 0, 0, 0]
        twist = SPEED_M_S * direction / np.linalg.norm(direction)
        settle(arm, states, float(rng.uniform(0.15, 0.2)))
        commanded_s = CLOCK.now_s()
        moved = drive(arm, twist if k % 2 else -twist, 0.3, ages)
        states += moved
        arm.stop()
        steady = [s for s in moved if s.t_s > commanded_s + 0.2]
        wanted = twist if k % 2 else -twist
        errors += [float(np.linalg.norm(s.twist_tool[:3] - wanted[:3])) / SPEED_M_S for s in steady]
        at_client.append(first_motion(moved) - commanded_s)
        speeds = loopback.control.tool_speeds(commanded_s - 0.05)
        moving = speeds[np.linalg.norm(speeds[:, 1:4], axis=1) > 1e-3]
        at_controller.append(float(moving[0, 0]) - commanded_s)
    span_s = CLOCK.now_s() - start_s
    share = (cpu_s(loopback.pid) - start_cpu_s) / span_s
    gaps = np.diff([s.t_s for s in states])
    line("command → first moving state, its stamp, at the client", at_client)
    line("command → first motion, true joints at the controller", at_controller)
    median, mean, p99 = np.median(errors), np.mean(errors), np.percentile(errors, 99)
    print(f"TCP speed error, of {SPEED_M_S} m/s: median {median:.4f}, mean {mean:.4f}, ", end="")
    print(f"p99 {p99:.4f} (fractions; 1e-4 rad/s of joint noise included)")
    seen = len(states) / (states[-1].t_s - states[0].t_s)
    print(f"states: {seen:.1f} per s over {span_s:.0f} s, longest gap {1e3 * gaps.max():.1f} ms")
    line("age of the newest state when read", ages)
    print(f"emulated controller, MuJoCo at 500 Hz included: {100.0 * share:.1f} % of one core")


def fault_times(
    arm: UrArm, loopback: LoopbackProcess, fault: str, seeds: int
) -> tuple[list[float], list[float], set[str]]:
    """Fault → error raised, fault → true rest, and the errors' names."""
    rng = np.random.default_rng(2)
    seen, stopped, kinds = [], [], set()
    for k in range(seeds):
        twist = np.array([SPEED_M_S if k % 2 else -SPEED_M_S, 0, 0, 0, 0, 0])
        drive(arm, twist, float(rng.uniform(0.2, 0.3)), [])
        ordered_s = CLOCK.now_s()
        loopback.control.fault(fault, for_s=0.5 if fault in ("stall", "emergency_stop") else 0.0)
        try:
            drive(arm, twist, 3.0, [])
            kinds.add("NOT SEEN")
        except RigError as error:
            seen.append(CLOCK.now_s() - ordered_s)
            kinds.add(type(error).__name__)
        CLOCK.sleep_until(ordered_s + 0.9)
        stopped.append(rest_after(loopback, ordered_s))
        arm.recover(lambda explanation: True)
    return seen, stopped, kinds


def kill_time(loopback: LoopbackProcess, kill: Callable[[int, int], None]) -> float:
    """How long the arm moved on after its program, its child, or both were killed."""
    command = [sys.executable, "-m", "tests.drivers.ur.drive_forever", HOST, "10"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as program:
        assert program.stdout is not None
        child = int(program.stdout.readline())
        killed_s = CLOCK.now_s()
        kill(program.pid, child)
        CLOCK.sleep_until(killed_s + 0.8)
        program.kill()
    taken_s = rest_after(loopback, killed_s)
    recover_controller(HOST, CLOCK, lambda explanation: True)
    return taken_s


def _kill_program(program: int, child: int) -> None:
    os.kill(program, signal.SIGKILL)


def _kill_child(program: int, child: int) -> None:
    os.kill(child, signal.SIGKILL)


def _kill_both(program: int, child: int) -> None:
    os.kill(child, signal.SIGKILL)
    os.kill(program, signal.SIGKILL)


KILLS = {
    "SIGKILL of the program": _kill_program,
    "SIGKILL of the child": _kill_child,
    "SIGKILL of both (watchdog at 10 Hz)": _kill_both,
}


def drive(arm: UrArm, twist: FloatArray, for_s: float, ages: list[float]) -> list[ArmState]:
    """Command at 100 Hz; the states that came."""
    states: list[ArmState] = []
    start_s = CLOCK.now_s()
    tick = 0
    while tick * 0.01 < for_s:
        arm.command_twist(twist, HOLD_S)
        fresh = arm.read_states()
        if fresh:
            ages.append(CLOCK.now_s() - fresh[-1].t_s)
        states += fresh
        tick += 1
        CLOCK.sleep_until(start_s + tick * 0.01)
    return states + arm.read_states()


def cpu_s(pid: int) -> float:
    """Processor time that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def settle(arm: UrArm, states: list[ArmState], for_s: float) -> None:
    """Read on at rest."""
    end_s = CLOCK.now_s() + for_s
    while CLOCK.now_s() < end_s:
        states += arm.read_states()
        CLOCK.sleep_until(CLOCK.now_s() + 0.01)


def first_motion(states: list[ArmState]) -> float:
    """The stamp of the first state above 2 % of the commanded speed."""
    return next(s.t_s for s in states if np.linalg.norm(s.twist_tool[:3]) > 0.02 * SPEED_M_S)


def rest_after(loopback: LoopbackProcess, since_s: float) -> float:
    """Seconds from ``since_s`` to the last true motion above 1 mm/s or mrad/s."""
    speeds = loopback.control.tool_speeds(since_s - 0.05)
    moving = speeds[np.abs(speeds[:, 1:]).max(axis=1) > 1e-3]
    return float(moving[-1, 0]) - since_s if len(moving) else 0.0


def line(name: str, values_s: list[float]) -> None:
    """One row of times."""
    ms = 1e3 * np.array(values_s)
    print(
        f"{name}: median {np.median(ms):.1f} ms, p99 {np.percentile(ms, 99):.1f} ms, "
        f"most {ms.max():.1f} ms ({len(ms)})"
    )


def report(fault: str, seen_s: list[float], stopped_s: list[float], kinds: set[str]) -> None:
    """The rows of one fault."""
    line(f"{fault} → error in the program", seen_s)
    line(f"{fault} → arm at rest at the controller", stopped_s)
    print(f"{fault}: {', '.join(sorted(kinds))}")


if __name__ == "__main__":
    main()
