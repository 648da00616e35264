"""The serial gantry against the emulated controller: delays, tracking, stops, faults.

``python -m benchmarks.bench_grbl``: on simulated time (the same figures on every machine), then
over a pty in real time, where the figures include this machine's scheduling.
"""

import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.clock import WallClock, thread_cpu_time_s
from drivers.errors import RigError
from drivers.grbl.arm import GrblArm
from sim_backend.loopback_grbl import faults
from sim_backend.loopback_grbl.machine import Machine
from sim_backend.loopback_grbl.process import LoopbackGantryProcess
from tests.drivers.grbl.simulated import CLIENT, Gantry, settings_for

FloatArray = NDArray[np.float64]

X = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
ALL_AXES = np.array([1.0, 0.3, -0.2, 2.0, 3.0, -2.5])  # of the linear speed, m/s and rad/s
MACHINES = {
    "6 axes, 115200 baud": Machine(),
    "6 axes, 1 Mbaud (USB)": Machine(baud=1_000_000),
    "3 axes, 115200 baud": Machine(axes=3),
}
FAULTS = ("alarm", "emergency_stop", "door", "reset", "stall")
CLOCK = WallClock()


def direction(machine: Machine) -> FloatArray:
    """A twist that moves every axis the machine has."""
    return ALL_AXES if machine.axes == 6 else X


def step_response(machine: Machine) -> str:
    """From 20 to 40 mm/s: delay, then the speed error once the delay is taken out."""
    gantry = Gantry(machine)
    towards = direction(machine)
    gantry.drive(0.02 * towards, 2.0)
    stepped_s = gantry.clock.now_s()
    gantry.states.clear()
    gantry.drive(0.04 * towards, 2.0)
    t, q, qd = gantry.motion(stepped_s - 1.0)
    n = machine.axes
    speeds = np.array(
        [
            gantry.kinematics.tool_twist(a[:n], b[:n])[0]
            for a, b in zip(q[::2], qd[::2], strict=True)
        ]
    )
    times = t[::2]
    after = times > stepped_s
    delay_s = float(times[after][np.flatnonzero(speeds[after] > 0.03)[0]] - stepped_s)
    wanted = np.where(times - delay_s < stepped_s, 0.02, 0.04)
    inside = times < stepped_s + 1.5
    rms = float(np.sqrt(np.mean((speeds - wanted)[inside] ** 2)))
    return f"delay {delay_s * 1e3:5.0f} ms   tracking rms {rms * 1e3:4.2f} mm/s"


def states(machine: Machine) -> str:
    """How often states come, and how old the newest one is at any moment."""
    gantry = Gantry(machine)
    gantry.drive(0.02 * direction(machine), 1.0)
    gantry.states.clear()
    ages = []
    for _ in range(500):
        gantry.drive(0.02 * direction(machine), 0.010)
        ages.append(gantry.clock.now_s() - gantry.states[-1].t_s if gantry.states else np.nan)
    p50, p99, most = np.nanpercentile(ages, [50, 99, 100]) * 1e3
    return f"{len(gantry.states) / 5.0:4.1f} states/s   age {p50:.0f} / {p99:.0f} / {most:.0f} ms"


def stop_time(machine: Machine, speed_m_s: float, how: Callable[[Gantry], None]) -> float:
    """Milliseconds from the stop to the last true motion, the worst of ten phases."""
    worst_s = 0.0
    for phase in range(10):
        gantry = Gantry(machine)
        gantry.drive(speed_m_s * X, 0.8 + 0.0017 * phase)
        begun_s = gantry.clock.now_s()
        how(gantry)
        worst_s = max(worst_s, gantry.rest_after(begun_s))
    return worst_s * 1e3


def fault(machine: Machine, name: str) -> str:
    """When a fault is noticed and when the arm stands, the worst of ten phases."""
    noticed, rest, error = [], [], ""
    for phase in range(10):
        gantry = Gantry(machine)
        gantry.drive(0.05 * X, 0.6 + 0.0031 * phase)
        begun_s = gantry.clock.now_s()
        faults.inject(gantry.firmware, name)
        while gantry.core.failure is None:
            gantry.core.command(0.05 * X, 0.1, gantry.clock.now_s())
            gantry.run(0.002)
        noticed.append(gantry.clock.now_s() - begun_s)
        rest.append(gantry.rest_after(begun_s))
        error = type(gantry.core.failure).__name__
    return f"{error:12s} noticed {max(noticed) * 1e3:4.0f} ms   rest {max(rest) * 1e3:4.0f} ms"


def simulated() -> None:
    """Everything on simulated time."""
    for name, machine in MACHINES.items():
        print(f"{name} (simulated time)")
        print(f"  step 20 -> 40 mm/s    {step_response(machine)}")
        print(f"  states                {states(machine)}")
        for speed in (0.05, 0.2):
            stop = stop_time(machine, speed, lambda gantry: gantry.core.stop())
            dry = stop_time(machine, speed, lambda gantry: gantry.drive(0.0 * X, 0.4))
            print(
                f"  from {speed * 1e3:3.0f} mm/s         stop() {stop:4.0f} ms   zero {dry:4.0f} ms"
            )
        expiry = stop_time(machine, 0.05, lambda _: None)
        print(f"  hold_s of 50 ms over  rest {expiry:4.0f} ms after the last tick, from 50 mm/s")
    for name in FAULTS:
        print(f"  fault {name:15s} {fault(MACHINES['6 axes, 115200 baud'], name)}")


def pace(arm: GrblArm, twist: FloatArray, span_s: float) -> tuple[int, list[float]]:
    """Command at 100 Hz; the number of states and their ages."""
    count, newest_s, ages = 0, np.nan, []
    next_s = CLOCK.now_s()
    end_s = next_s + span_s
    while next_s < end_s:
        arm.command_twist(twist, 0.1)
        next_s += 0.01
        CLOCK.sleep_until(next_s)
        for state in arm.read_states():
            count, newest_s = count + 1, state.t_s
        ages.append(CLOCK.now_s() - newest_s)
    return count, ages


def real_time(folder: Path) -> None:
    """Over a pty, the controller in a process of its own."""
    for name, machine in MACHINES.items():
        arguments = ("--axes", str(machine.axes), "--baud", str(machine.baud))
        with LoopbackGantryProcess(folder / "gantry", arguments) as gantry:
            settings = settings_for(machine, port=str(gantry.port), self_test_mm=5.0)
            arm = GrblArm(settings, CLOCK)
            try:
                twist = 0.04 * direction(machine)
                pace(arm, twist, 0.5)
                begun_s = CLOCK.now_s()
                count, ages = pace(arm, twist, 3.0)
                rate = count / (CLOCK.now_s() - begun_s)
                stopped_s = CLOCK.now_s()
                arm.stop()
                CLOCK.sleep_until(stopped_s + 0.5)
                rest_ms = rest_ms_after(gantry.control.motion(stopped_s), stopped_s)
                p50, p99, most = np.nanpercentile(ages, [50, 99, 100]) * 1e3
                timing = arm.timing
                print(
                    f"{name} (pty)\n  round trip {timing.round_trip_s * 1e3:.1f} ms, at most "
                    f"{timing.round_trip_max_s * 1e3:.1f}; self-test delay "
                    f"{timing.command_delay_s * 1e3:.0f} ms; bandwidth {timing.bandwidth_hz:.2f} Hz"
                    f"\n  {rate:.1f} states/s, age {p50:.0f} / {p99:.0f} / {most:.0f} ms"
                    f"; stop() to rest {rest_ms:.0f} ms"
                )
            finally:
                arm.close()


def killed(folder: Path) -> None:
    """SIGKILL of a client in motion at 50 mm/s: how long and far the queue carries on."""
    times, ways = [], []
    for _ in range(5):
        with LoopbackGantryProcess(folder / "gantry") as gantry:
            client = subprocess.Popen(
                [sys.executable, "-c", CLIENT, str(gantry.port)], stdout=subprocess.PIPE
            )
            assert client.stdout is not None
            client.stdout.readline()
            client.kill()
            killed_s = CLOCK.now_s()
            client.wait()
            client.stdout.close()
            CLOCK.sleep_until(killed_s + 0.6)
            rows = gantry.control.motion(killed_s)
            times.append(rest_ms_after(rows, killed_s))
            ways.append(1e3 * (rows[-1, 1] - rows[0, 1]))
    print(
        f"SIGKILL at 50 mm/s: moves on {min(times):.0f} to {max(times):.0f} ms, "
        f"{min(ways):.1f} to {max(ways):.1f} mm"
    )


def rest_ms_after(rows: FloatArray, since_s: float) -> float:
    """Milliseconds to the last row that moves."""
    moving = np.flatnonzero(np.any(rows[:, 7:] != 0.0, axis=1))
    return float(rows[moving[-1], 0] - since_s) * 1e3 if moving.size else 0.0


def cost() -> None:
    """Processor time of the driver's core, emulator excluded."""
    gantry = Gantry(MACHINES["6 axes, 115200 baud"])
    spent = [0.0]
    exchange = gantry.session.exchange

    def timed(data: bytes) -> None:
        begun_s = thread_cpu_time_s()
        exchange(data)
        spent[0] += thread_cpu_time_s() - begun_s

    gantry.session.exchange = timed  # type: ignore[method-assign]
    gantry.drive(0.04 * ALL_AXES, 5.0)
    print(f"driver core: {spent[0] / 5.0 * 100:.1f} % of a processor, all axes moving")


def main() -> None:
    """Print every figure."""
    simulated()
    cost()
    with tempfile.TemporaryDirectory() as folder:
        try:
            real_time(Path(folder))
            killed(Path(folder))
        except RigError as error:
            print(f"failed: {error}")
    assert threading.active_count() < 5


if __name__ == "__main__":
    main()
