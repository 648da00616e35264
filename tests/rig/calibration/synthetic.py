"""An exact camera, arm and board of their own: the truth that the fits must find."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.image.intrinsics import Intrinsics
from rig.calibration.views import BoardView, PosedView

FloatArray = NDArray[np.float64]

SIZE = (640, 480)
SQUARE_M = 0.03


def board_points(square_m: float = SQUARE_M) -> FloatArray:
    """The 24 inner corners of 7 x 5 squares, row by row."""
    y, x = np.mgrid[1:5, 1:7]
    return square_m * np.stack([x.ravel(), y.ravel(), np.zeros(24)], axis=1)


def transform(xyz: FloatArray, rotvec: FloatArray) -> FloatArray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotvec).as_matrix()
    T[:3, 3] = xyz
    return T


@dataclass(frozen=True)
class Truth:
    """One bench, chosen at random."""

    intrinsics: Intrinsics
    T_tool_camera: FloatArray
    T_base_board: FloatArray
    points_m: FloatArray = field(default_factory=board_points)

    def camera_from_tool(self, T_base_tool: FloatArray) -> FloatArray:
        """T_camera_board."""
        return np.linalg.inv(T_base_tool @ self.T_tool_camera) @ self.T_base_board

    def pixels(self, T_base_tool: FloatArray) -> FloatArray:
        T = self.camera_from_tool(T_base_tool)
        return self.intrinsics.project(self.points_m @ T[:3, :3].T + T[:3, 3])

    def tool_looking(
        self,
        distance_m: float,
        tilt_rad: float,
        azimuth_rad: float,
        spin_rad: float,
        aim_m: FloatArray | None = None,
    ) -> FloatArray:
        """T_base_tool from which the camera sees the board's point ``aim_m`` in its middle."""
        aim = self.points_m.mean(axis=0) if aim_m is None else aim_m
        # OpenCV's board looks along its own −z; the camera's z points towards the board.
        lean = Rotation.from_rotvec(
            tilt_rad * np.array([np.cos(azimuth_rad), np.sin(azimuth_rad), 0])
        )
        R_board_camera = (lean * Rotation.from_rotvec([0, 0, spin_rad])).as_matrix()
        T_board_camera = np.eye(4)
        T_board_camera[:3, :3] = R_board_camera
        T_board_camera[:3, 3] = aim - distance_m * R_board_camera[:, 2]
        return self.T_base_board @ T_board_camera @ np.linalg.inv(self.T_tool_camera)


def random_truth(seed: int, distortion: bool = True) -> Truth:
    """A bench that no fit has seen; the tool points down, where rotation vectors flip."""
    rng = np.random.default_rng([seed, 77])
    f = 800.0 * (1 + rng.uniform(-0.05, 0.05))
    d = np.zeros(5)
    if distortion:
        d[:4] = rng.uniform(-1, 1, 4) * [0.15, 0.1, 0.001, 0.001]
    return Truth(
        Intrinsics(
            f, f * (1 + rng.uniform(-2e-3, 2e-3)), *rng.uniform([307.5, 227.5], [331.5, 251.5]), d
        ),
        transform(
            np.array([0.03, -0.02, 0.06]) + rng.uniform(-0.015, 0.015, 3),
            np.array([0.10, -0.08, 0.12]) + rng.uniform(-0.08, 0.08, 3),
        ),
        transform(
            np.array([0.4, 0.1, 0.02]) + rng.uniform(-0.1, 0.1, 3), [np.pi * 0.999, 0.02, -0.03]
        ),
    )


def tool_poses(truth: Truth, count: int, seed: int, tilt_rad: float = 0.6) -> list[FloatArray]:
    """Poses that show most of the board, tilted, spun and shifted at random."""
    rng = np.random.default_rng([seed, 78])
    poses = []
    while len(poses) < count:
        T = truth.tool_looking(
            rng.uniform(0.3, 0.5),
            rng.uniform(0.3, 1.0) * tilt_rad,
            rng.uniform(-np.pi, np.pi),
            rng.uniform(-1.2, 1.2),
            truth.points_m.mean(axis=0) + rng.uniform(-0.06, 0.06, 3) * [1, 1, 0],
        )
        if inside(truth.pixels(T)).sum() >= 16:
            poses.append(T)
    return poses


def inside(pixels: FloatArray, margin_px: float = 6.0) -> NDArray[np.bool_]:
    low, high = np.full(2, margin_px), np.array(SIZE) - 1 - margin_px
    return np.all((pixels >= low) & (pixels <= high), axis=1)


def view(
    truth: Truth,
    T_base_tool: FloatArray,
    rng: np.random.Generator,
    noise_px: float = 0.07,
    claimed_m: FloatArray | None = None,
) -> BoardView:
    """The noisy corners in view; ``claimed_m`` replaces where the board is said to have them."""
    pixels = truth.pixels(T_base_tool)
    kept = inside(pixels)
    noisy = pixels + noise_px * rng.standard_normal(pixels.shape)
    points = truth.points_m if claimed_m is None else claimed_m
    return BoardView(np.flatnonzero(kept), points[kept], noisy[kept])


def jitter(rng: np.random.Generator, sigma_m: float, sigma_rad: float) -> FloatArray:
    """A small random motion: an arm's pose error."""
    return transform(sigma_m * rng.standard_normal(3), sigma_rad * rng.standard_normal(3))


def posed_views(
    truth: Truth,
    count: int,
    seed: int,
    noise_px: float = 0.07,
    arm_m: float = 20e-6,
    arm_rad: float = 30e-6,
    tilt_rad: float = 0.6,
    claimed_m: FloatArray | None = None,
) -> list[PosedView]:
    """What a session records: noisy corners and slightly wrong arm poses."""
    rng = np.random.default_rng([seed, 79])
    return [
        PosedView(view(truth, T, rng, noise_px, claimed_m), T @ jitter(rng, arm_m, arm_rad))
        for T in tool_poses(truth, count, seed, tilt_rad)
    ]
