"""The motion in front of the board that a latency can be read from."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Without common divisors: nothing repeats within a segment.
_FREQUENCIES_HZ = (0.53, 0.87, 1.31, 1.73)


@dataclass(frozen=True)
class Excitation:
    """A band-limited wiggle of the camera that starts and ends at rest where it began."""

    duration_s: float
    amplitude_m: float = 0.015  # of the displacement along x and y, at most
    amplitude_rad: float = 0.04  # of the turn about x, y and z, at most
    seed: int = 1
    phases: FloatArray = field(init=False, repr=False)  # (6, frequencies)

    def __post_init__(self) -> None:
        random = np.random.default_rng(self.seed)
        object.__setattr__(self, "phases", random.uniform(-np.pi, np.pi, (6, 4)))

    def displacement(self, t_s: float) -> FloatArray:
        """Displacement (6,) of the camera in its starting axes: x, y, z in m, turns in rad."""
        return np.asarray(self._moved(np.array([t_s]))[0], dtype=float)

    def twist_camera(self, t_s: float) -> FloatArray:
        """The rate (6,) of ``displacement``."""
        h = 1e-4
        ahead, behind = self._moved(np.array([t_s + h, t_s - h]))
        return np.asarray((ahead - behind) / (2 * h), dtype=float)

    @property
    def top_speed(self) -> tuple[float, float]:
        """The largest linear (m/s) and angular (rad/s) speed on the way."""
        times = np.arange(0.0, self.duration_s, 0.005)
        rate = np.gradient(self._moved(times), 0.005, axis=0)
        sizes = [np.max(np.linalg.norm(rate[:, part], axis=1)) for part in (slice(3), slice(3, 6))]
        return float(sizes[0]), float(sizes[1])

    def _moved(self, times_s: FloatArray) -> FloatArray:
        share = np.clip(times_s / self.duration_s, 0.0, 1.0)
        window = np.sin(np.pi * share) ** 2
        angle = 2 * np.pi * np.multiply.outer(times_s, _FREQUENCIES_HZ)
        waves = np.sin(angle[:, None, :] + self.phases).sum(axis=2) / len(_FREQUENCIES_HZ)
        size = np.array([self.amplitude_m] * 2 + [0.0] + [self.amplitude_rad] * 3)
        return np.asarray(size * waves * window[:, None], dtype=float)
