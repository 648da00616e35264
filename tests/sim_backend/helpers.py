"""Rigs and numbers shared by the tests of the simulated rig."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from sim_backend.clock import SimulatedClock
from sim_backend.config import BackgroundConfig, LightConfig, SimConfig
from sim_backend.config_targets import StartPose
from sim_backend.lens import Lens, lens_of
from sim_backend.raster import RasterRenderer
from sim_backend.rig import SimulatedRig
from sim_backend.scene import Scene, TargetKind, build_scene
from sim_backend.start import start_pose

FloatArray = NDArray[np.float64]

FLAT = {
    "light": LightConfig(ambient=1.0),
    "background": BackgroundConfig(kind="plain", low_grey=20.0),
}
WHITE, BLACK = 225.0, 20.0  # the greys of target and floor under FLAT


def built(
    target: TargetKind, clock: SimulatedClock | None = None, **settings: object
) -> tuple[SimulatedRig, SimulatedClock]:
    """A rig with the software renderer on simulated time, and its clock."""
    clock = clock or SimulatedClock()
    config = SimConfig.model_validate({"renderer": "raster", **settings})
    return SimulatedRig(config, target, clock), clock


def camera(**settings: object) -> dict[str, object]:
    """Camera settings on top of a noise-free camera that delivers on time."""
    quiet = {"noise_grey": 0.0, "latency_s": 0.0, "latency_jitter_s": 0.0, "exposure_s": 0.0}
    return {**quiet, **settings}


def view(
    target: TargetKind, start: StartPose, **settings: object
) -> tuple[Scene, Lens, FloatArray]:
    """A scene, a lens and the pose that ``start`` describes."""
    config = SimConfig.model_validate(settings)
    scene, lens = build_scene(config, target), lens_of(config.camera)
    return scene, lens, start_pose(scene.target, start, lens)


def drawn(scene: Scene, lens: Lens, T: FloatArray) -> FloatArray:
    """The noise-free picture by the software renderer."""
    return RasterRenderer(scene, lens).render(T[None], (0, lens.height)).astype(float)


def coverage(image: FloatArray) -> FloatArray:
    """The share of each pixel that the target covers, under FLAT."""
    return (image - BLACK) / (WHITE - BLACK)


def circle(angles: FloatArray, axis: FloatArray, half_angle: float) -> FloatArray:
    """Unit rays (n, 3) on the cone of ``half_angle`` around ``axis``."""
    e = axis / np.linalg.norm(axis)
    a = np.cross(e, [1.0, 0.0, 0.0])
    a /= np.linalg.norm(a)
    b = np.cross(e, a)
    around = np.cos(angles)[:, None] * a + np.sin(angles)[:, None] * b
    rays: FloatArray = np.cos(half_angle) * e + np.sin(half_angle) * around
    return rays


def polygon_area_and_centroid(points: FloatArray) -> tuple[float, FloatArray]:
    """Of a closed polygon (n, 2)."""
    x, y = points.T
    x1, y1 = np.roll(x, -1), np.roll(y, -1)
    cross = x * y1 - x1 * y
    area = cross.sum() / 2
    centroid = np.array([((x + x1) * cross).sum(), ((y + y1) * cross).sum()]) / (6 * area)
    return abs(float(area)), centroid


def up_to_the_middle(row: FloatArray) -> FloatArray:
    """The part of a scan line left of the middle of what it shows covered."""
    middle = round(float((row * np.arange(row.size)).sum() / row.sum()))
    return row[:middle]


def left_edge(row: FloatArray) -> float:
    """Where a scan line's covered stretch begins, from the covered share of its pixels."""
    return float((1.0 - up_to_the_middle(row)).sum() - 0.5)


def fit_first_order_lag(t: FloatArray, y: FloatArray) -> float:
    """The time constant of a response that has risen to its last value."""

    def error(p: FloatArray) -> FloatArray:
        return np.asarray(1.0 - np.exp(-np.maximum(t - p[1], 0.0) / p[0]) - y)

    return float(least_squares(error, [0.02, 0.0]).x[0])
