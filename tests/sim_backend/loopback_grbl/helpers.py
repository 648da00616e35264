"""A firmware on the tests' own time, with what it says and how it moves."""

import numpy as np
from numpy.typing import NDArray

from sim_backend.loopback_grbl.firmware import Firmware
from sim_backend.loopback_grbl.machine import Machine

FloatArray = NDArray[np.float64]

EXACT = Machine(clock_rate=1.0, lost_status=0.0)
EXACT_GRBL = Machine(flavour="Grbl", axes=3, clock_rate=1.0, lost_status=0.0)


class Bench:
    """A firmware at time zero, in the middle of its range."""

    def __init__(self, machine: Machine = EXACT, locked: bool = False) -> None:
        self.machine = machine
        self.firmware = Firmware(machine, machine.column(machine.joint_zero), 0.0, locked)
        self.now_s = 0.0

    def send(self, text: str | bytes) -> None:
        """Write to the controller now."""
        data = text if isinstance(text, bytes) else text.encode()
        self.firmware.receive(data, self.now_s)

    def wait(self, span_s: float) -> str:
        """Let time pass; what was heard meanwhile."""
        heard = ""
        end_s = self.now_s + span_s
        while self.now_s < end_s - 1e-9:
            self.now_s = min(self.now_s + 0.001, end_s)
            self.firmware.advance_to(self.now_s)
            heard += self.firmware.send(self.now_s).decode("ascii")
        return heard

    def ask(self, line: str, span_s: float = 0.2) -> list[str]:
        """Send a line; the lines heard within ``span_s``."""
        self.send(line + "\n")
        return self.wait(span_s).split()

    def status(self) -> str:
        """A status report, or nothing."""
        self.send(b"?")
        reports = [line for line in self.wait(0.03).split() if line.startswith("<")]
        return reports[-1] if reports else ""

    def motion(self, since_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times (n,), joint positions (n, 6) and velocities (n, 6) since an instant."""
        history = self.firmware.history
        numbers = np.arange(round((since_s - history.start_s) / history.step_s), history.count)
        q, qd = history.entries(numbers)
        times: FloatArray = np.asarray(history.start_s + numbers * history.step_s, dtype=float)
        return times, q, qd

    def stream(self, speed_mm_s: float, span_s: float) -> None:
        """Jog along x in blocks of 20 ms, all written at once."""
        for _ in range(round(span_s / 0.02)):
            self.send(f"$J=G91G21X{speed_mm_s * 0.02:.3f}F{speed_mm_s * 60:.1f}\n")
