"""What the camera's linear velocity should be: constant, or turned by (24) to tell the most."""

import math
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimator.estimate import Estimate
from estimator.jit import jit, jit_template

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


@runtime_checkable
class InformedPolicy(Protocol):
    """A policy that goes by what is known of the target."""

    def inform(self, estimate: Estimate) -> None:
        """Take the newest estimate into account."""
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
        self._k1 = float(k1)
        self._k2 = float(k2)
        # Compiles the kernel now rather than in the middle of a run; no time, no change.
        self.advance(None, np.zeros(3), 0.0)

    @property
    def v(self) -> FloatArray:
        """The velocity (3,) wanted now, in m/s."""
        return self._v.copy()

    def advance(self, axis: FloatArray | None, omega: FloatArray, dt_s: float) -> None:
        """Integrate (24) over ``dt_s`` for the axis and the ω of now."""
        fastest = max(self._k1, 2.0 * self._k2, math.hypot(*omega))
        steps = max(1, math.ceil(dt_s * fastest / _MAX_GAIN_STEP))
        self._v = _advanced(self._v, _known(axis), omega, self._gains(axis), dt_s / steps, steps)

    def v_dot(self, v: FloatArray, axis: FloatArray | None, omega: FloatArray) -> FloatArray:
        """v̇ (3,) of (24) at v, in m/s²."""
        return _v_dot(v, _known(axis), omega, self._gains(axis))

    def _gains(self, axis: FloatArray | None) -> tuple[float, float, float]:
        """κ_des, k1 and k2; on a sphere there is nothing to climb."""
        return self._kappa_des, self._k1, 0.0 if axis is None else self._k2


def _known(axis: FloatArray | None) -> FloatArray:
    return np.zeros(3) if axis is None else axis


@jit
def _advanced(
    v: FloatArray,
    axis: FloatArray,
    omega: FloatArray,
    gains: tuple[float, float, float],
    h: float,
    steps: int,
) -> FloatArray:
    """v after steps of ``h`` seconds by Runge and Kutta's rule."""
    for _ in range(steps):
        r1 = _v_dot(v, axis, omega, gains)
        r2 = _v_dot(_sum(v, 0.5 * h, r1), axis, omega, gains)
        r3 = _v_dot(_sum(v, 0.5 * h, r2), axis, omega, gains)
        r4 = _v_dot(_sum(v, h, r3), axis, omega, gains)
        v = _sum(v, h / 6.0, _sum(_sum(r1, 2.0, r2), 1.0, _sum(r4, 2.0, r3)))
    return v


@jit_template
def _v_dot(
    v: FloatArray, axis: FloatArray, omega: FloatArray, gains: tuple[float, float, float]
) -> FloatArray:
    kappa_des, k1, k2 = gains
    square = _dot(v, v)
    along = _sum(np.zeros(3), k1 * (kappa_des - 0.5 * square) / square, v)
    if k2 == 0.0:
        return along
    ascent = _sum(_gradient(v, axis), -1.0, _compensation(v, axis, omega))
    across = _sum(ascent, -_dot(v, ascent) / square, v)
    return _sum(along, k2, across)


@jit_template
def _gradient(v: FloatArray, axis: FloatArray) -> FloatArray:
    """J_vᵀ, or the push out of v ∥ a in its place."""
    useful = _sum(v, -_dot(axis, v), axis)
    speed = math.sqrt(_dot(v, v))
    share = math.sqrt(_dot(useful, useful)) / speed
    gradient = _sum(useful, 1.0, useful)
    if share >= _ESCAPE_SHARE:
        return gradient
    # Blends into J_vᵀ at the edge of the region, so v̇ stays continuous.
    return _sum(gradient, 2.0 * (_ESCAPE_SHARE - share) * speed, _sideways(axis))


@jit_template
def _compensation(v: FloatArray, axis: FloatArray, omega: FloatArray) -> FloatArray:
    """J_v† J_a [a]× ω, bounded by |aᵀv| ‖ω‖, and faded out where J_v† has no direction."""
    along = _dot(v, axis)
    useful = _sum(v, -along, axis)
    gradient = _sum(useful, 1.0, useful)
    edge = 2.0 * _ESCAPE_SHARE * math.sqrt(_dot(v, v))
    norm = max(math.sqrt(_dot(gradient, gradient)), edge)
    turning = np.array(
        [
            axis[1] * omega[2] - axis[2] * omega[1],
            axis[2] * omega[0] - axis[0] * omega[2],
            axis[0] * omega[1] - axis[1] * omega[0],
        ]
    )
    J_a_turning = -2.0 * along * _dot(v, turning)
    return _sum(np.zeros(3), J_a_turning / (norm * norm), gradient)


@jit_template
def _sideways(axis: FloatArray) -> FloatArray:
    """The unit vector across ``axis`` within the image plane; along x for a ∥ z."""
    norm = math.sqrt(axis[0] * axis[0] + axis[1] * axis[1])
    if norm > 1e-6:
        return np.array([-axis[1] / norm, axis[0] / norm, 0.0])
    return np.array([1.0, 0.0, 0.0])


@jit_template
def _dot(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@jit_template
def _sum(a: FloatArray, factor: float, b: FloatArray) -> FloatArray:
    """a + factor · b (3,)."""
    return np.array([a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]])


def _velocity(v: ArrayLike) -> FloatArray:
    velocity = np.array(v, dtype=float)
    if velocity.shape != (3,) or not np.isfinite(velocity).all():
        raise ValueError(f"a velocity is three finite numbers in m/s, not {v!r}")
    return velocity
