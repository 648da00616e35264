"""A wiggle in front of the board: stamped corners and the arm's samples."""

from dataclasses import dataclass

import numpy as np

from rig.calibration import se3
from rig.calibration.excitation import Excitation
from rig.calibration.trajectory import Trajectory
from rig.calibration.views import BoardView, StampedView
from tests.rig.calibration.synthetic import FloatArray, Truth, inside, tool_poses


@dataclass(frozen=True)
class Session:
    """What was recorded, and the path it was recorded on."""

    views: list[StampedView]
    arm: Trajectory

    @property
    def halves(self) -> tuple[list[StampedView], list[StampedView]]:
        half = len(self.views) // 2
        return self.views[:half], self.views[half:]


def wiggle_session(
    truth: Truth,
    seed: int,
    latency_s: float,
    row_time_s: float = 0.0,
    noise_px: float = 0.05,
    jitter_s: float = 0.0,
    shrink: float = 1.0,
    arm_hz: float = 500.0,
) -> Session:
    """Five seconds at 30 frames a second; stamps are late by ``latency_s``.

    ``shrink`` reduces the motion; encoders step by 5 µm and 20 µrad.
    """
    rng = np.random.default_rng([seed, 80])
    motion = Excitation(5.0, amplitude_m=0.015 * shrink, amplitude_rad=0.04 * shrink, seed=seed)
    T_first, X = tool_poses(truth, 1, seed)[0], truth.T_tool_camera

    def tool(times_s: FloatArray) -> FloatArray:
        moved = np.array([motion.displacement(t) for t in times_s])
        return T_first @ X @ se3.exp(moved) @ np.linalg.inv(X)

    times = np.arange(-1.0, 6.0, 1.0 / arm_hz)
    steps = rng.uniform(-0.5, 0.5, (len(times), 6)) * np.repeat([5e-6, 20e-6], 3)
    arm = Trajectory(times, tool(times) @ se3.exp(steps))
    views = []
    for t in np.arange(0.0, 5.0, 1.0 / 30.0) + 0.0031:
        pixels = truth.pixels(tool(np.array([t]))[0])
        if row_time_s:
            for _ in range(2):  # a row's instant depends on the row
                rows = tool(t + row_time_s * (pixels[:, 1] - 239.5))
                pixels = np.array([truth.pixels(T)[i] for i, T in enumerate(rows)])
        kept = inside(pixels)
        noisy = pixels + noise_px * rng.standard_normal(pixels.shape)
        if kept.sum() >= 8:
            board = BoardView(np.flatnonzero(kept), truth.points_m[kept], noisy[kept])
            stamp = t + latency_s + jitter_s * rng.standard_normal()
            views.append(StampedView(board, float(stamp)))
    return Session(views, arm)
