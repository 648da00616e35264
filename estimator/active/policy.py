"""What the camera's linear velocity should be: constant, or turned by (24) to tell the most."""

import math
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimator.active.sigma2 import J_a, J_v, useful_velocity
from estimator.cross import cross

FloatArray = NDArray[np.float64]

# Share of ‖v‖ below which the useful part of v counts as none and is given a direction.
_ESCAPE_SHARE = 0.01

# Largest product of a gain of (24) and an integration step: far inside RK4's stability.
_MAX_GAIN_STEP = 0.2


class VelocityPolicy(Protocol):
    """A rule for the camera's linear velocity, in the camera frame."""

    @property
    def v(self) -> FloatArray:
        """The velocity (3,) wanted now, in m/s."""
        ...

    def advance(self, axis: FloatArray | None, omega: FloatArray, dt_s: float) -> None:
        """Let ``dt_s`` pass while the camera turns at ω (3,) and a is ``axis`` (None: sphere)."""
        ...


class ConstantVelocity:
    """The same velocity in the camera frame for ever."""

    def __init__(self, v: ArrayLike) -> None:
        self._v = _velocity(v)

    @property
    def v(self) -> FloatArray:
        """The velocity (3,), in m/s."""
        return self._v.copy()

    def advance(self, axis: FloatArray | None, omega: FloatArray, dt_s: float) -> None:
        """Nothing changes."""


class PaperPolicy:
    """Equation (24): v keeps ‖v0‖ (gain k1) and turns up the gradient of σ1² (gain k2).

    With k2 = 0 only the norm is held. On a sphere the gradient is along v and v stays constant.
    As printed the projector takes part of the compensation of ω away, so while the axis turns
    σ1² may rest slightly below its maximum: by v·[a]×ω / (2 k2), squared.
    Where v ∥ a the gradient vanishes (an unstable equilibrium): there v is pushed sideways in a
    fixed direction, across a and as parallel to the image plane as can be.
    Raises ValueError for v0 = 0 or a negative gain.
    """

    def __init__(self, v0: ArrayLike, k1: float, k2: float) -> None:
        self._v = _velocity(v0)
        if not float(np.linalg.norm(self._v)) > 0.0:
            raise ValueError("PaperPolicy needs a velocity v0 that is not zero")
        if not (k1 >= 0.0 and k2 >= 0.0 and math.isfinite(k1 + k2)):
            raise ValueError(f"the gains of (24) must not be negative: k1 = {k1}, k2 = {k2}")
        self._kappa_des = 0.5 * float(self._v @ self._v)
        self._k1 = k1
        self._k2 = k2

    @property
    def v(self) -> FloatArray:
        """The velocity (3,) wanted now, in m/s."""
        return self._v.copy()

    def advance(self, axis: FloatArray | None, omega: FloatArray, dt_s: float) -> None:
        """Integrate (24) over ``dt_s`` for the axis and the ω of now."""
        fastest = max(self._k1, 2.0 * self._k2, float(np.linalg.norm(omega)))
        steps = max(1, math.ceil(dt_s * fastest / _MAX_GAIN_STEP))
        h = dt_s / steps
        for _ in range(steps):
            r1 = self.v_dot(self._v, axis, omega)
            r2 = self.v_dot(self._v + 0.5 * h * r1, axis, omega)
            r3 = self.v_dot(self._v + 0.5 * h * r2, axis, omega)
            r4 = self.v_dot(self._v + h * r3, axis, omega)
            self._v = self._v + (h / 6.0) * (r1 + 2.0 * r2 + 2.0 * r3 + r4)

    def v_dot(self, v: FloatArray, axis: FloatArray | None, omega: FloatArray) -> FloatArray:
        """v̇ (3,) of (24) at v, in m/s²."""
        square = float(v @ v)
        along = self._k1 * (self._kappa_des - 0.5 * square) / square
        if axis is None or self._k2 == 0.0:
            return along * v
        ascent = _gradient(v, axis) - _compensation(v, axis, omega)
        across = ascent - v * (float(v @ ascent) / square)
        return along * v + self._k2 * across


def _gradient(v: FloatArray, axis: FloatArray) -> FloatArray:
    """J_vᵀ, or the push out of v ∥ a in its place."""
    useful = useful_velocity(v, axis)
    speed = float(np.linalg.norm(v))
    share = float(np.linalg.norm(useful)) / speed
    if share >= _ESCAPE_SHARE:
        return J_v(v, axis)
    # Blends into J_vᵀ at the edge of the region, so v̇ stays continuous.
    push = 2.0 * (_ESCAPE_SHARE - share) * speed
    return J_v(v, axis) + push * _sideways(axis)


def _compensation(v: FloatArray, axis: FloatArray, omega: FloatArray) -> FloatArray:
    """J_v† J_a [a]× ω, bounded by |aᵀv| ‖ω‖, and faded out where J_v† has no direction."""
    gradient = J_v(v, axis)
    norm = float(np.linalg.norm(gradient))
    edge = 2.0 * _ESCAPE_SHARE * float(np.linalg.norm(v))
    inverse = gradient / max(norm, edge) ** 2
    return inverse * float(J_a(v, axis) @ cross(axis, omega))


def _sideways(axis: FloatArray) -> FloatArray:
    """The unit vector across ``axis`` within the image plane; along x for a ∥ z."""
    across = np.array([-axis[1], axis[0], 0.0])
    norm = float(np.linalg.norm(across))
    return across / norm if norm > 1e-6 else np.array([1.0, 0.0, 0.0])


def _velocity(v: ArrayLike) -> FloatArray:
    velocity = np.array(v, dtype=float)
    if velocity.shape != (3,) or not np.isfinite(velocity).all():
        raise ValueError(f"a velocity is three finite numbers in m/s, not {v!r}")
    return velocity
