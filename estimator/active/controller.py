"""From what is known of the target to the twist the camera should have."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.active.centring import centring_omega
from estimator.active.policy import InformedPolicy, VelocityPolicy
from estimator.estimate import Estimate

FloatArray = NDArray[np.float64]


class CameraMotion(Protocol):
    """What moves the camera."""

    def twist(self, estimate: Estimate, dt_s: float) -> FloatArray:
        """The camera's twist (6,) (v, ω) for now; what it plans then moves on ``dt_s``."""
        ...

    def arrived(self, estimate: Estimate) -> bool:
        """Whether the camera is where it has to get, if it has to get anywhere."""
        ...

    def status(self, estimate: Estimate) -> str:
        """How far it is from there, or ""."""
        ...


class Controller:
    """A velocity policy with the target kept centred.

    ``centring_gain_per_s`` is the bandwidth of the centring loop: with predicted estimates and
    an arm that lags by 20 ms anything up to 10/s is well damped. ``max_omega_rad_s`` bounds ‖ω‖,
    for a target found far off centre. Raises ValueError unless both are positive.
    """

    def __init__(
        self,
        policy: VelocityPolicy,
        centring_gain_per_s: float = 5.0,
        max_omega_rad_s: float = 1.0,
    ) -> None:
        if not (centring_gain_per_s > 0.0 and max_omega_rad_s > 0.0):
            raise ValueError("the centring gain and the bound on the turning rate must be positive")
        self._policy = policy
        self._gain_per_s = centring_gain_per_s
        self._max_omega_rad_s = max_omega_rad_s

    def twist(self, estimate: Estimate, dt_s: float) -> FloatArray:
        """The camera's twist (6,) (v, ω) for now; the policy's velocity then moves on ``dt_s``."""
        if isinstance(self._policy, InformedPolicy):
            self._policy.inform(estimate)
        v = self._policy.v
        omega = centring_omega(estimate.s, estimate.axis, estimate.chi, v, self._gain_per_s)
        norm = float(np.linalg.norm(omega))
        if norm > self._max_omega_rad_s:
            omega *= self._max_omega_rad_s / norm
        self._policy.advance(estimate.axis, omega, dt_s)
        return np.concatenate((v, omega))

    def arrived(self, estimate: Estimate) -> bool:
        """Always: there is no place to get to."""
        return True

    def status(self, estimate: Estimate) -> str:
        """Nothing to tell."""
        return ""
