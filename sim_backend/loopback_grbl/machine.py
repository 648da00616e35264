"""What the emulated gantry is: axes, limits, memory and firmware flavour."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LETTERS = "XYZABC"
_MM_PER_M = 1000.0
_DEG_PER_RAD = 180.0 / math.pi


@dataclass(frozen=True, slots=True)
class Machine:
    """A gantry of three slides (mm) and up to three wrist axes (deg), as its ``$$`` tells it.

    Machine coordinates are zero at the home corner and negative elsewhere, as Grbl has them;
    a rotary axis has its zero in the middle. ``joint_zero`` is the machine coordinate of each
    joint's own zero, ``joint_sign`` its direction. The defaults are the simulated rig's gantry.
    """

    flavour: Literal["grblHAL", "Grbl"] = "grblHAL"
    axes: int = 6
    baud: int = 115200
    steps_per_unit: tuple[float, ...] = (100.0,) * 6
    max_rate: tuple[float, ...] = (15000.0,) * 3 + (21600.0,) * 3  # units per minute
    acceleration: tuple[float, ...] = (1000.0,) * 3 + (2000.0,) * 3  # units per second²
    low: tuple[float, ...] = (-1600.0, -1600.0, -1550.0, -100.0, -87.0, -360.0)
    high: tuple[float, ...] = (0.0, 0.0, 0.0, 100.0, 87.0, 360.0)
    joint_zero: tuple[float, ...] = (-800.0, -800.0, -800.0, 0.0, 0.0, 0.0)
    joint_sign: tuple[float, ...] = (1.0,) * 6
    soft_limits: bool = True
    homing: bool = True
    rotary_in_norm: int = 0  # $701
    # The oscillator of a microcontroller board is not a crystal: seconds it counts per second.
    clock_rate: float = 1.005
    lost_status: float = 0.02  # share of the status requests that get no answer
    seed: int = 1

    @property
    def planner_blocks(self) -> int:
        """How many blocks the planner holds; plain Grbl keeps 15 of its 16."""
        return 100 if self.flavour == "grblHAL" else 15

    @property
    def rx_bytes(self) -> int:
        """How many received bytes wait for the parser at most."""
        return 1024 if self.flavour == "grblHAL" else 128

    @property
    def banner(self) -> str:
        """What a reset prints."""
        if self.flavour == "grblHAL":
            return "GrblHAL 1.1f ['$' or '$HELP' for help]"
        return "Grbl 1.1h ['$' for help]"

    @property
    def letters(self) -> str:
        """The axes' letters in order."""
        return LETTERS[: self.axes]

    def column(self, values: tuple[float, ...]) -> FloatArray:
        """One of the per-axis tuples as an array (axes,)."""
        return np.array(values[: self.axes], dtype=float)

    def joints(self, position: FloatArray) -> FloatArray:
        """Joint positions (6,) in m and rad at machine coordinates (axes,) in mm and deg.

        Missing wrist axes stay at zero.
        """
        q = np.zeros(6)
        zero, sign = self.column(self.joint_zero), self.column(self.joint_sign)
        q[: self.axes] = sign * (position - zero) / self._per_si()
        return q

    def joint_rates(self, velocity: FloatArray) -> FloatArray:
        """Joint velocities (6,) in m/s and rad/s at axis velocities (axes,) in units/s."""
        qd = np.zeros(6)
        qd[: self.axes] = self.column(self.joint_sign) * velocity / self._per_si()
        return qd

    def machine_position(self, q: FloatArray) -> FloatArray:
        """Machine coordinates (axes,) of joint positions ``q`` (6,) in m and rad."""
        sign, zero = self.column(self.joint_sign), self.column(self.joint_zero)
        position: FloatArray = sign * q[: self.axes] * self._per_si() + zero
        return position

    def _per_si(self) -> FloatArray:
        return np.array([_MM_PER_M] * 3 + [_DEG_PER_RAD] * 3)[: self.axes]
