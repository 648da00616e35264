"""The driver's core on simulated time against the emulated controller, without any thread."""

import numpy as np
from numpy.typing import NDArray

from drivers.errors import RigError
from drivers.grbl.kinematics import GantryKinematics
from drivers.grbl.session import Session
from drivers.grbl.settings import AxisSettings, GrblSettings, WristSettings, standard_axes
from drivers.interfaces import ArmState
from sim_backend.clock import SimulatedClock
from sim_backend.loopback_grbl.direct import DirectLink
from sim_backend.loopback_grbl.firmware import Firmware
from sim_backend.loopback_grbl.machine import Machine

FloatArray = NDArray[np.float64]

TICK_S = 0.010
START_S = 50.0
WRIST = WristSettings(centre_xyz_m=(0.0, 0.0, 0.9), tool_xyz_m=(0.0, 0.0, -0.05))

# A program that moves at 50 mm/s until it is killed; it says so once it does.
CLIENT = """
import sys
import numpy as np
from drivers.clock import WallClock
from drivers.grbl.arm import GrblArm
from drivers.grbl.settings import GrblSettings
clock = WallClock()
arm = GrblArm(GrblSettings(port=sys.argv[1], silence_s=0.6), clock)
next_s, told = clock.now_s(), False
begun_s = next_s
while clock.now_s() < begun_s + 20.0:
    arm.command_twist(np.array([0.05, 0, 0, 0, 0, 0]), 0.1)
    next_s += 0.01
    clock.sleep_until(next_s)
    arm.read_states()
    if not told and clock.now_s() > begun_s + 0.5:
        told = True
        print("moving", flush=True)
"""


def axes_of(machine: Machine) -> tuple[AxisSettings, ...]:
    """The axes of the emulated gantry as a rig would configure them."""
    return tuple(
        axis.model_copy(update={"mpos_at_zero": zero, "mpos_min": low, "mpos_max": high})
        for axis, zero, low, high in zip(
            standard_axes(machine.axes),
            machine.joint_zero,
            machine.low,
            machine.high,
            strict=False,
        )
    )


def settings_for(machine: Machine, **changes: object) -> GrblSettings:
    """Settings that fit the emulated gantry."""
    given = {"port": "sim", "baud": machine.baud, "axes": axes_of(machine), "wrist": WRIST}
    return GrblSettings.model_validate(given | changes)


class Gantry:
    """A connected driver core and the gantry behind it."""

    def __init__(
        self, machine: Machine, q_start: FloatArray | None = None, **changes: object
    ) -> None:
        self.clock = SimulatedClock(START_S)
        start = machine.machine_position(np.zeros(6) if q_start is None else q_start)
        self.firmware = Firmware(machine, start, START_S)
        self.settings = settings_for(machine, **changes)
        self.link = DirectLink(self.firmware, self.clock)
        self.session = Session(self.settings, self.clock, self.link)
        self.core = self.session.core
        self.kinematics = GantryKinematics(self.settings.axes or (), self.settings.wrist)
        self.states: list[ArmState] = []
        self.run(0.2)

    def run(self, span_s: float) -> None:
        """Let the driver and the gantry go on for a while."""
        self.session.run_for(span_s)
        self.states += self.core.take_states()

    def drive(self, twist: FloatArray, span_s: float, hold_s: float = 0.05) -> None:
        """Command ``twist`` every 10 ms for a while; ends early when the core failed."""
        end_s = self.clock.now_s() + span_s
        while self.clock.now_s() < end_s and self.core.failure is None:
            self.core.command(twist, hold_s, self.clock.now_s())
            self.run(TICK_S)

    def failure(self) -> RigError:
        """The core's failure, which there must be."""
        assert self.core.failure is not None
        return self.core.failure

    def q(self) -> FloatArray:
        """True joint positions (6,) now."""
        q: FloatArray = self.firmware.joints()[0][0]
        return q

    def moving(self) -> bool:
        """Whether any axis truly moves."""
        return bool(np.any(self.firmware.joints()[1]))

    def motion(self, since_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times (n,), true joint positions and velocities (n, 6) since an instant."""
        history = self.firmware.history
        first = round((since_s - history.start_s) / history.step_s)
        numbers = np.arange(first, history.count)
        q, qd = history.entries(numbers)
        times: FloatArray = np.asarray(history.start_s + numbers * history.step_s, dtype=float)
        return times, q, qd

    def rest_after(self, since_s: float, span_s: float = 1.5) -> float:
        """Run for ``span_s``; seconds from ``since_s`` to the last true motion."""
        self.run(span_s)
        t, _, qd = self.motion(since_s)
        moving = np.flatnonzero(np.any(qd != 0.0, axis=1))
        return float(t[moving[-1]] - since_s) if moving.size else 0.0
