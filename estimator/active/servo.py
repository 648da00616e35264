"""A visual servo whose spare freedom makes the radius known."""

import math

import numpy as np
from numpy.typing import NDArray

from estimator.active.null_space import AroundTarget
from estimator.active.servo_task import ServoTask
from estimator.estimate import Estimate

FloatArray = NDArray[np.float64]


class ServoController:
    """Brings the target to its wanted place and distance, and moves around it meanwhile.

    For s of a sphere or a cylinder, ṡ = −χ v − ω × s (v across a cylinder's axis). What v has
    along s sets the distance, by R̂ as it is known now; ω sets the direction of s and makes up for
    what v has across s. So any v across s is in the null space of the task: ``around`` spends it
    on information, with all speed while the stated 95 % interval of R is wider than
    ± ``wanted_share`` and with none once it is half as wide.

    Along s the camera goes at ``distance_gain_per_s`` times the error, bounded by ``speed_m_s``,
    and by 0.71 of it while the radius is uncertain: then the rest is spent across s.
    ``around`` None leaves the null space alone. Raises ValueError unless all are positive.
    """

    def __init__(
        self,
        task: ServoTask,
        speed_m_s: float,
        wanted_share: float,
        around: AroundTarget | None,
        distance_gain_per_s: float = 2.0,
        centring_gain_per_s: float = 5.0,
        max_omega_rad_s: float = 1.0,
    ) -> None:
        numbers = (speed_m_s, wanted_share, distance_gain_per_s, centring_gain_per_s)
        if not min(*numbers, max_omega_rad_s) > 0.0:
            raise ValueError("a servo's speed, gains and bounds must be positive")
        self._task = task
        self._speed_m_s = speed_m_s
        self._wanted_share = wanted_share
        self._around = around
        self._distance_gain_per_s = distance_gain_per_s
        self._centring_gain_per_s = centring_gain_per_s
        self._max_omega_rad_s = max_omega_rad_s

    def twist(self, estimate: Estimate, dt_s: float) -> FloatArray:
        """The camera's twist (6,) (v, ω) for now."""
        norm = float(np.linalg.norm(estimate.s))
        sight = estimate.s / norm
        spare = 0.0 if self._around is None else self._curiosity(estimate)
        along = self._approach(estimate, spare) * sight
        v = along
        if self._around is not None:
            speed = spare * math.sqrt(max(self._speed_m_s**2 - float(along @ along), 0.0))
            v = along + self._around.velocity(estimate, along, speed, dt_s)
        omega = self._turning(sight) - np.cross(sight, v) * (estimate.chi / norm)
        rate = float(np.linalg.norm(omega))
        if rate > self._max_omega_rad_s:
            omega *= self._max_omega_rad_s / rate
        return np.concatenate((v, omega))

    def arrived(self, estimate: Estimate) -> bool:
        """Whether the target is in its place, as far as is known."""
        return self._task.done(estimate)

    def status(self, estimate: Estimate) -> str:
        """How far it is from there."""
        off_m = self._task.off_m(estimate)
        distance = "–" if off_m is None else f"{1e3 * off_m:+.1f} mm"
        return f"{self._task.off_px(estimate):.1f} px, {distance}"

    def _curiosity(self, estimate: Estimate) -> float:
        """1 while the radius is less certain than wanted, falling to 0 at twice as certain."""
        return min(max(2.0 * estimate.interval_share / self._wanted_share - 1.0, 0.0), 1.0)

    def _approach(self, estimate: Estimate, spare: float) -> float:
        """The speed along the line of sight, towards the target."""
        off_m = self._task.off_m(estimate)
        if off_m is None:
            return 0.0
        fastest = self._speed_m_s * math.sqrt(1.0 - 0.5 * spare * spare)
        return min(max(self._distance_gain_per_s * off_m, -fastest), fastest)

    def _turning(self, sight: FloatArray) -> FloatArray:
        """ω (3,) that takes the line of sight to the wanted one, the shorter way round."""
        axis = np.cross(sight, self._task.bearing)
        sine = float(np.linalg.norm(axis))
        if sine == 0.0:
            return np.zeros(3)
        angle = math.atan2(sine, float(sight @ self._task.bearing))
        return -self._centring_gain_per_s * angle / sine * axis
