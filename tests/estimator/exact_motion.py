"""An exactly known camera motion past a target: the reference the estimator's tests share.

The pose is integrated from the twist to 1e-12, and what the camera sees follows from the pose
alone, never from the differential equations the estimator is built on.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from estimator.image.feature import Feature
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]
Twist = Callable[[float], FloatArray]  # t_s -> (6,) v, ω of the camera in its own frame


def skew(a: ArrayLike) -> FloatArray:
    """[a]× (3, 3)."""
    x, y, z = np.asarray(a, dtype=float)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@dataclass(frozen=True)
class Target:
    """A sphere, or a cylinder if ``axis`` is given, in the camera frame of t = 0."""

    point_m: FloatArray  # (3,) centre, or any point of the axis
    radius_m: float
    axis: FloatArray | None = None  # (3,) unit

    def seen_from(self, R: FloatArray, position_m: FloatArray) -> Feature:
        """The exact feature for a camera at ``position_m`` with axes R (3, 3)."""
        point = R.T @ (self.point_m - position_m)
        if self.axis is None:
            return Feature(point / self.radius_m, np.zeros((3, 3)))
        a = R.T @ self.axis
        return Feature((point - a * (a @ point)) / self.radius_m, np.zeros((3, 3)), a)


class Trajectory:
    """The camera's pose along ``twist`` from the identity at t = 0, to 1e-12."""

    def __init__(self, twist: Twist, duration_s: float) -> None:
        def rate(t_s: float, pose: FloatArray) -> FloatArray:
            R, u = pose[:9].reshape(3, 3), twist(t_s)
            return np.concatenate(((R @ skew(u[3:])).ravel(), R @ u[:3]))

        start = np.concatenate((np.eye(3).ravel(), np.zeros(3)))
        self.twist = twist
        self.duration_s = duration_s
        solution = solve_ivp(
            rate, (0.0, duration_s), start, "DOP853", dense_output=True,
            rtol=1e-12, atol=1e-12, max_step=0.02,
        )  # fmt: skip
        assert solution.sol is not None
        self._pose = solution.sol

    def feature(self, target: Target, t_s: float) -> Feature:
        """What the camera sees at ``t_s``."""
        pose = self._pose(t_s)
        return target.seen_from(pose[:9].reshape(3, 3), pose[9:])

    def axis_at(self, target: Target, t_s: float) -> FloatArray | None:
        """The cylinder's axis in the camera frame at ``t_s``, None for the sphere."""
        return self.feature(target, t_s).axis

    def history(
        self, rate_hz: float = 500.0, noise: FloatArray | None = None, delay_s: float = 0.0
    ) -> TwistHistory:
        """The twist sampled at ``rate_hz`` over the whole motion, ``noise`` (n, 6) added."""
        count = round(self.duration_s * rate_hz) + 1
        stamps = np.arange(count) / rate_hz
        samples = np.array([self.twist(max(t - delay_s, 0.0)) for t in stamps])
        history = TwistHistory(span_s=self.duration_s + 1.0)
        history.extend(stamps, samples if noise is None else samples + noise[:count])
        return history


BALL = Target(np.array([0.01, -0.02, 0.25]), 0.019)
PIPE = Target(
    np.array([0.02, -0.03, 0.4]),
    0.042,
    np.array([0.35, 0.9, 0.2]) / np.linalg.norm([0.35, 0.9, 0.2]),
)


def lively(speed_m_s: float, ramp_s: float) -> Twist:
    """From rest to about ``speed_m_s``, the direction, the norm and ω all changing."""

    def twist(t_s: float) -> FloatArray:
        share = min(t_s / ramp_s, 1.0)
        ramp = share * share * (3.0 - 2.0 * share)
        v = np.array([-np.cos(1.1 * t_s), 0.8 * np.sin(1.7 * t_s + 0.4), 0.3 * np.sin(0.9 * t_s)])
        omega = np.array(
            [0.15 * np.sin(1.3 * t_s), -0.2 * np.cos(1.1 * t_s), 0.1 * np.sin(2.1 * t_s)]
        )
        return np.concatenate((speed_m_s * ramp * v, ramp * omega))

    return twist
