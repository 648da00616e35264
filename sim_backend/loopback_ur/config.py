"""Which controller is emulated."""

from dataclasses import dataclass, field

from sim_backend.loopback_ur.kinematics import HOME_Q
from sim_backend.loopback_ur.motion import STEP_S, MotionConfig

_CB3 = 3


@dataclass(frozen=True, slots=True)
class ControllerConfig:
    """Which controller is emulated."""

    version: tuple[int, int, int, int] = (5, 15, 0, 0)
    serial_number: str = "20225500001"
    tcp_offset: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    q_start: tuple[float, ...] = tuple(float(x) for x in HOME_Q)
    timestamp_start_s: float = 1000.0  # the controller's clock has an origin of its own
    clock_error: float = 20e-6  # and a rate of its own
    speed_noise_rad_s: float = 1e-4  # of each reported joint speed
    unlock_after_s: float = 5.0  # a protective stop cannot be unlocked earlier
    motion: MotionConfig = field(default_factory=MotionConfig)

    @property
    def is_cb3(self) -> bool:
        """Whether this is a controller of the generation before the e-Series."""
        return self.version[0] <= _CB3

    @property
    def cycles_per_tick(self) -> int:
        """Cycles of 2 ms from one look at the registers to the next."""
        return 4 if self.is_cb3 else 1

    @property
    def rate_hz(self) -> float:
        """How often the controller looks at its registers and reports."""
        return 1.0 / (STEP_S * self.cycles_per_tick)


def version_of(text: str) -> tuple[int, int, int, int]:
    """The version written "5.15" or "3.15.8.106339"; raises ValueError for anything else."""
    parts = text.split(".")
    if not 1 <= len(parts) <= 4 or not all(part.isdecimal() for part in parts):
        raise ValueError(f"{text!r} is no controller version: write it as 5.15.0 or 3.15.8")
    major, minor, bugfix, build = (*map(int, parts), 0, 0, 0)[:4]
    return major, minor, bugfix, build
