"""One lively motion from rest, the images along it, and an observer's errors from them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.active.sigma2 import sigma2
from estimator.ideal import ideal_response
from estimator.models.cylinder import Cylinder
from estimator.models.model import Model
from estimator.models.sphere import Sphere
from estimator.observer import Observer
from estimator.twist_history import TwistHistory
from tests.estimator.exact_motion import BALL, PIPE, Target, Trajectory, lively

FloatArray = NDArray[np.float64]

DURATION_S = 4.0
MOTION = Trajectory(lively(0.05, 0.3), DURATION_S)
EXACT = MOTION.history()
REGULAR = np.arange(0.0, DURATION_S, 1.0 / 30.0)
TARGETS = [pytest.param(BALL, id="sphere"), pytest.param(PIPE, id="cylinder")]


def model_of(target: Target) -> Model:
    return Sphere() if target.axis is None else Cylinder()


def irregular(seed: int) -> FloatArray:
    """30 Hz with 10 ms of jitter in the exposure, 10 % of the frames missing."""
    rng = np.random.default_rng(seed)
    stamps = REGULAR[:-1] + rng.uniform(0.0, 0.01, REGULAR.size - 1)
    kept = rng.random(stamps.size) >= 0.1
    return stamps[kept]


def response(
    observer: Observer,
    target: Target,
    stamps: FloatArray,
    history: TwistHistory,
    motion: Trajectory = MOTION,
) -> FloatArray:
    """z after each image."""
    z = []
    for t_s in stamps:
        observer.correct(motion.feature(target, t_s), t_s, history)
        assert observer.estimate is not None
        z.append(1.0 / target.radius_m - observer.estimate.chi)
    return np.array(z)


def ideal(
    target: Target,
    alpha: float,
    damping: float,
    z0: float,
    at: FloatArray,
    motion: Trajectory = MOTION,
) -> FloatArray:
    """(5) with the true σ²."""
    t_s = np.append(np.arange(at[0], at[-1], 1e-3), at[-1])
    rows = [sigma2(motion.twist(t)[:3], motion.axis_at(target, t)) for t in t_s]
    return ideal_response(t_s, np.array(rows), alpha, damping, z0, at)
