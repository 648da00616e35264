"""A kinematic rig in pure arithmetic: a lagging arm, late images, the controller in the loop."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.active.controller import Controller
from estimator.active.sigma2 import sigma2
from estimator.image.feature import Feature
from estimator.observer import Observer
from estimator.twist_history import TwistHistory
from tests.estimator.exact_motion import Target

FloatArray = NDArray[np.float64]

STEP_S = 0.002  # the arm's own rate
TICK_STEPS = 5  # control at 100 Hz
FRAME_S = 1.0 / 30.0


@dataclass(frozen=True)
class Conditions:
    """What the rig does to images and commands."""

    latency_s: float = 0.06
    jitter_s: float = 0.02
    dropped: float = 0.1
    lag_s: float = 0.02
    v_noise_m_s: float = 2e-4
    omega_noise_rad_s: float = 5e-4
    s_noise: float = 0.0


@dataclass(frozen=True)
class Run:
    """What happened: a row per control tick, and apart from it per image and per arm sample."""

    t_s: FloatArray  # (n,)
    s: FloatArray  # (n, 3) true
    command: FloatArray  # (n, 6)
    twist: FloatArray  # (n, 6) true
    inverse_radius: FloatArray  # (n,) χ̂
    image_t_s: FloatArray  # (k,) exposure instants of the images used
    image_inverse_radius: FloatArray  # (k,) χ̂ after each
    arm_t_s: FloatArray  # (j,)
    sigma2: FloatArray  # (j,) true


def drive(
    target: Target,
    observer: Observer,
    controller: Controller,
    duration_s: float,
    conditions: Conditions,
    seed: int = 0,
) -> Run:
    """Run the loop from rest; before the first image the arm stands."""
    rng = np.random.default_rng(seed)
    R, position = np.eye(3), np.zeros(3)
    twist, command = np.zeros(6), np.zeros(6)
    history = TwistHistory(span_s=2.0)
    noise = np.repeat([conditions.v_noise_m_s, conditions.omega_noise_rad_s], 3)
    waiting: list[tuple[float, float, Feature]] = []  # arrival, stamp, feature
    next_frame_s = 0.0
    rows: list[tuple[float, FloatArray, FloatArray, FloatArray, float]] = []
    images: list[tuple[float, float]] = []
    arm: list[tuple[float, float]] = []
    for index in range(round(duration_s / STEP_S)):
        t_s = index * STEP_S
        history.append(t_s, twist + noise * rng.standard_normal(6))
        arm.append(
            (t_s, float(sigma2(twist[:3], None if target.axis is None else R.T @ target.axis)))
        )
        if t_s >= next_frame_s:
            next_frame_s += FRAME_S
            if rng.random() >= conditions.dropped:
                seen = target.seen_from(R, position)
                s = seen.s + conditions.s_noise * rng.standard_normal(3)
                arrival = t_s + conditions.latency_s + conditions.jitter_s * rng.uniform(-1.0, 1.0)
                waiting.append((arrival, t_s, Feature(s, seen.covariance, seen.axis)))
        if index % TICK_STEPS == 0:
            arrived = sorted((w for w in waiting if w[0] <= t_s), key=lambda w: w[0])
            for _, stamp, feature in arrived:
                observer.correct(feature, stamp, history)
                if observer.estimate is not None and observer.estimate.t_s == stamp:
                    images.append((stamp, observer.estimate.chi))
            waiting = [w for w in waiting if w[0] > t_s]
            if observer.estimate is not None:
                estimate = observer.predict(t_s, history)
                command = controller.twist(estimate, TICK_STEPS * STEP_S)
                rows.append((t_s, target.seen_from(R, position).s, command, twist, estimate.chi))
        after = command + (twist - command) * np.exp(-STEP_S / conditions.lag_s)
        mean = 0.5 * (twist + after)
        half = Rotation.from_rotvec(0.5 * STEP_S * mean[3:]).as_matrix()
        position = position + R @ half @ (STEP_S * mean[:3])
        R = R @ half @ half
        twist = after
    columns = [
        np.array(column) for table in (rows, images, arm) for column in zip(*table, strict=True)
    ]
    return Run(*columns)
