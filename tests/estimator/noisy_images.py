"""Exact images with the noise that outlines have, and a filter run along them."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.estimate import Estimate
from estimator.image.feature import Feature
from estimator.kalman import KalmanFilter, RadiusPrior, TwistNoise
from estimator.twist_history import TwistHistory
from tests.estimator.exact_motion import Target, Twist
from tests.estimator.responses import model_of

FloatArray = NDArray[np.float64]

FOCAL_PX = 800.0
TWIST = TwistNoise(2e-4, 5e-4)
SAMPLE_S = 0.002


def noisy(exact: Feature, noise_px: float, rng: np.random.Generator) -> Feature:
    """What an outline whose half-size is uncertain by ``noise_px`` shows."""
    s, angle = exact.s, noise_px / FOCAL_PX
    norm = float(np.linalg.norm(s))
    n = s / norm
    b = np.cross(np.array([0.0, 1.0, 0.0]) if exact.axis is None else exact.axis, n)
    b /= np.linalg.norm(b)
    c = np.cross(n, b)
    stds = angle * norm * np.array([np.sqrt(norm**2 - 1.0), 1.4, 1.4])
    tilt = 0.0 if exact.axis is None else 3.0 * angle * norm
    stds[2] = stds[2] if exact.axis is None else norm * tilt
    B = np.array([n, b, c])
    covariance = B.T @ np.diag(stds**2) @ B
    draw = stds * rng.standard_normal(3)
    if exact.axis is None:
        return Feature(s + B.T @ draw, covariance)
    turn = Rotation.from_rotvec(draw[1] / norm * exact.axis + draw[2] / norm * b)
    return Feature(turn.apply(s * (1.0 + draw[0] / norm)), covariance, turn.apply(exact.axis))


def guessed(target: Target, guess: float = 1.5) -> KalmanFilter:
    """A filter whose guess is off by the factor ``guess``, on an arm like ``NoisyArm``."""
    guess_m = guess * target.radius_m
    prior = RadiusPrior(guess_m, guess_m / 3.0, guess_m * 3.0)
    return KalmanFilter(model_of(target), prior, TWIST)


class NoisyArm:
    """The measured twist of a known motion, with fresh noise for every seed."""

    def __init__(self, twist: Twist, duration_s: float) -> None:
        self.times_s = np.arange(0.0, duration_s + SAMPLE_S / 2, SAMPLE_S)
        self._twists = np.array([twist(t) for t in self.times_s])
        self._std = np.repeat([TWIST.linear_m_s, TWIST.angular_rad_s], 3)

    def history(self, rng: np.random.Generator) -> TwistHistory:
        history = TwistHistory(span_s=self.times_s[-1] + 1.0)
        noise = self._std * rng.standard_normal(self._twists.shape)
        history.extend(self.times_s, self._twists + noise)
        return history


def estimates(
    kalman: KalmanFilter,
    stamps: FloatArray,
    exact: list[Feature],
    arm: NoisyArm,
    noise_px: float,
    seed: int,
) -> Iterator[Estimate]:
    """What the filter says after each noisy image."""
    rng = np.random.default_rng(seed)
    history = arm.history(rng)
    for t_s, feature in zip(stamps, exact, strict=True):
        kalman.correct(noisy(feature, noise_px, rng), t_s, history)
        assert kalman.estimate is not None
        yield kalman.estimate
