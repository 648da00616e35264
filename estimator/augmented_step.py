"""One step of the filter on x = (s, χ, τ, κ), linearised about a point (χ, τ, κ).

An image stamped t was exposed at t − τ, and the camera moves with κ times the measured twist.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.displacement import displacement
from estimator.gain import REST_SIGMA
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]

CHI, TAU, KAPPA = 3, 4, 5

_FINEST = 1e-7  # of s, as a share: no image is more exact
_SCALE_STEP = 1e-4  # for the derivative by κ
# The twist is the mean of so many samples; beyond so many of its deviations it has changed.
_LATE_SAMPLES, _NOTICED = 10, 5.0


@dataclass(frozen=True, slots=True)
class Point:
    """What is linearised about."""

    chi: float
    tau_s: float
    kappa: float


@dataclass(frozen=True, slots=True)
class Image:
    """What one image showed, and its stamp."""

    t_s: float
    s: FloatArray  # (3,)
    axis: FloatArray  # (3,); zeros: none
    covariance: FloatArray  # (3, 3) of s


@dataclass(frozen=True, slots=True)
class AugmentedState:
    """x and P at an instant near the last image's exposure."""

    t_s: float
    x: FloatArray  # (6,)
    P: FloatArray  # (6, 6)
    axis: FloatArray  # (3,); zeros: none
    image_covariance: FloatArray  # (3, 3)
    residual: float
    steady: FloatArray  # (6,) the twist, held while it changes by no more than its noise


def first_state(
    image: Image,
    unknowns: FloatArray,
    covariance: FloatArray,
    point: Point,
    motion: TwistHistory,
) -> AugmentedState:
    """The state that one image tells, with χ, τ, κ (3,) and their covariance (3, 3) as given."""
    t_s, lag_s = _exposed(image, point, motion, -math.inf)
    twist = np.zeros(6)
    if len(motion):
        began_s = max(motion.start_s, t_s - _LATE_SAMPLES * motion.sample_s)
        twist = motion.window(began_s, t_s).twists_camera.mean(axis=0)
    rate = _rate(image.s, image.axis, point, twist)
    x, P = np.empty(6), np.zeros((6, 6))
    x[:3], x[CHI:] = image.s + rate * (unknowns[1] - lag_s), unknowns
    P[CHI:, CHI:] = covariance
    # s at t_s is what the image shows, carried over by the rate times an uncertain τ.
    P[:3, :3] = image.covariance + covariance[1, 1] * np.outer(rate, rate)
    P[:3, CHI:] = np.outer(rate, covariance[1])
    P[CHI:, :3] = P[:3, CHI:].T
    return AugmentedState(t_s, x, P, image.axis, image.covariance, 0.0, twist)


def next_state(
    state: AugmentedState,
    image: Image,
    point: Point,
    motion: TwistHistory,
    noise: FloatArray,
    time_std_s: float,
) -> tuple[AugmentedState, float]:
    """The state after the next image, and that image's normalised innovation squared.

    ``noise`` (6, 6) is the covariance of a measured twist where the arm knows none, ``time_std_s``
    the spread of an image's instant about its stamp less τ.
    """
    t_s, lag_s = _exposed(image, point, motion, state.t_s)
    across = np.eye(3) - np.outer(image.axis, image.axis)
    window = motion.window(state.t_s, t_s)
    spectrum = motion.spectrum(noise)
    x, P = _moved(state, across, point, window.times_s, window.twists_camera, spectrum)
    known = noise if motion.covariance is None else motion.covariance
    steady = _steady(state.steady, window.twists_camera, known)
    rate = _rate(x[:3], image.axis, point, steady)
    shown = x[:3] - rate * (x[TAU] - lag_s)
    B = _basis(image.axis)
    H = np.zeros((B.shape[1], 6))
    H[:, :3], H[:, TAU] = B.T, -(B.T @ rate)
    covariance = image.covariance + time_std_s**2 * np.outer(rate, rate)
    finest = (_FINEST**2 * float(image.s @ image.s)) * np.eye(B.shape[1])
    seen = B.T @ covariance @ B + finest
    innovation = B.T @ (image.s - shown)
    inverse = np.linalg.inv(H @ P @ H.T + seen)
    gain = P @ H.T @ inverse
    left = np.eye(6) - gain @ H
    P = left @ P @ left.T + gain @ seen @ gain.T
    residual = float(np.linalg.norm(image.s - shown))
    nis = float(innovation @ inverse @ innovation)
    after = AugmentedState(
        *(t_s, x + gain @ innovation, 0.5 * (P + P.T), image.axis),
        *(image.covariance, residual, steady),
    )
    return after, nis


def _exposed(
    image: Image, point: Point, motion: TwistHistory, after_s: float
) -> tuple[float, float]:
    """When the image was exposed, as far as the motion is known there, and how long before its
    stamp that is."""
    t_s = image.t_s - point.tau_s
    if len(motion):
        t_s = max(min(t_s, motion.end_s), motion.start_s)
    t_s = max(t_s, after_s)
    return t_s, image.t_s - t_s


def _steady(before: FloatArray, twists: FloatArray, noise: FloatArray) -> FloatArray:
    """The twist of late, unless it differs from ``before`` by no more than noise may.

    What changes with τ is where on the motion an image was taken: noise of the twist would pass
    for such changes, and a camera moving steadily would seem to tell τ.
    """
    late = twists[-_LATE_SAMPLES:]
    mean: FloatArray = late.mean(axis=0)
    change = np.abs(mean - before)
    if np.any(change > _NOTICED * np.sqrt(np.diag(noise) / len(late))):
        return mean
    return before


def _moved(
    state: AugmentedState,
    across: FloatArray,
    point: Point,
    times_s: FloatArray,
    twists: FloatArray,
    spectrum: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """x and P after a motion; slower than a camera that stands, its shift counts as noise."""
    duration_s = float(times_s[-1] - times_s[0])
    s, chi = state.x[:3], state.x[CHI]
    R, d = displacement(times_s, point.kappa * twists)
    R_more, d_more = displacement(times_s, (point.kappa + _SCALE_STEP) * twists)
    shift = across @ d
    by_kappa = across @ ((R_more - R) @ s - (d_more - d) * point.chi) / _SCALE_STEP
    F = np.eye(6)
    F[:3, :3] = across @ R
    standing = float(np.linalg.norm(shift)) < REST_SIGMA * duration_s
    if not standing:
        F[:3, CHI], F[:3, KAPPA] = -shift, by_kappa
    x = state.x.copy()
    x[:3] = across @ (R @ s) - shift * chi + by_kappa * (state.x[KAPPA] - point.kappa)
    P = F @ state.P @ F.T
    # A twist's error becomes one of ṡ; χ itself is uncertain too.
    spread = math.sqrt(chi * chi + state.P[CHI, CHI])
    G = across @ np.hstack((-spread * np.eye(3), _cross(x[:3])))
    P[:3, :3] += duration_s * (G @ spectrum @ G.T)
    if standing:
        P[:3, :3] += np.outer(shift, shift) * state.P[CHI, CHI]
    return x, P


def _rate(s: FloatArray, axis: FloatArray, point: Point, twist: FloatArray) -> FloatArray:
    """ṡ (3,) by (12) or (20)."""
    v, omega = point.kappa * twist[:3], point.kappa * twist[3:]
    rate: FloatArray = np.cross(s, omega) - point.chi * (v - axis * float(axis @ v))
    return rate


def _cross(s: FloatArray) -> FloatArray:
    """(3, 3) that maps ω to s × ω."""
    return np.array([[0.0, -s[2], s[1]], [s[2], 0.0, -s[0]], [-s[1], s[0], 0.0]])


def _basis(axis: FloatArray) -> FloatArray:
    """Unit vectors (3, k) that span where s may lie: all of space, or what is across the axis."""
    if not np.any(axis):
        return np.eye(3)
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    return np.column_stack((first, np.cross(axis, first)))
