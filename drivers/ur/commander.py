"""What to send to the controller now: the newest twist while it holds, a brake otherwise.

No vendor, no clock, no sockets: instants come in as arguments.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.ur.faults import fault_of
from drivers.ur.geometry import to_base_axes
from drivers.ur.ring import Sample
from drivers.ur.settings import UrSettings

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Speed:
    """One ``speedL``."""

    twist_base: FloatArray  # (6,) in base axes
    acceleration_m_s2: float


class Commander:
    """Keeps the newest command and enforces how long it may act."""

    def __init__(self, settings: UrSettings) -> None:
        self._settings = settings
        self._twist_tool = np.zeros(6)
        self._until_s = -np.inf
        self._moved = False

    def command(self, twist_tool: FloatArray, until_s: float) -> None:
        """Follow ``twist_tool`` (6,) until the instant ``until_s``."""
        self._twist_tool = np.array(twist_tool, dtype=float)
        self._until_s = until_s

    def stop(self) -> None:
        """Brake from now on."""
        self._until_s = -np.inf

    def faulty(self, sample: Sample | None, now_s: float) -> bool:
        """Whether the arm must not be commanded: its state is unknown, old or a fault."""
        settings = self._settings
        return (
            sample is None
            or now_s - sample.arrival_s > settings.max_state_age_s
            or fault_of(
                settings.host, sample.safety_status_bits, sample.robot_mode, sample.runtime_state
            )
            is not None
        )

    def output(self, now_s: float, sample: Sample | None) -> Speed | None:
        """What to send at ``now_s``; None while nothing has moved yet (feed the watchdog only).

        The twist is held in the tool's axes: it is turned by the newest measured orientation
        each time it goes out.
        """
        settings = self._settings
        holds = now_s < self._until_s
        if holds and sample is not None and not self.faulty(sample, now_s):
            if not self._moved and not np.any(self._twist_tool):
                return None
            self._moved = True
            twist = to_base_axes(sample.T_base_tool[:3, :3], self._twist_tool)
            return Speed(twist, settings.acceleration_m_s2)
        # What was cut short does not come back when the fault goes away.
        self._until_s = -np.inf
        return Speed(np.zeros(6), settings.stop_acceleration_m_s2) if self._moved else None
