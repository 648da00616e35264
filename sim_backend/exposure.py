"""Exposing one frame: which poses it averages over, row band by row band."""

import math
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim_backend.config import CameraConfig
from sim_backend.lens import Lens
from sim_backend.raster import floor_motion_px
from sim_backend.renderer import Renderer

FloatArray = NDArray[np.float64]

# Sub-exposures are this far apart in the image at the target's distance (and three times that
# on the floor): a third of a pixel blurs like continuous motion.
_SUB_EXPOSURE_STEP_PX = 0.3
_FLOOR_STEP_PX = 1.0
# Rows read so close in time that the image moves less than this share one pose.
_BAND_STEP_PX = 0.05


class MovingCamera(Protocol):
    """Where the camera was at any recorded instant."""

    def T_base_camera(self, t_s: float) -> FloatArray:
        """Pose (4, 4) at ``t_s``."""
        ...


class Exposure:
    """Averages renderings over the exposure time of each row."""

    def __init__(
        self, config: CameraConfig, lens: Lens, motion: MovingCamera, target_m: FloatArray
    ) -> None:
        self._exposure_s = config.exposure_s
        self._row_time_s = config.row_time_s
        self._most = config.max_sub_exposures
        self._lens = lens
        self._motion = motion
        self._target_m = target_m
        u, v = np.meshgrid(np.linspace(0, lens.width - 1, 3), np.linspace(0, lens.height - 1, 3))
        rays = lens.to_rays(np.stack([u.ravel(), v.ravel()], axis=1))
        self._rays = np.column_stack([rays, np.ones(9)])

    def render(self, renderer: Renderer, mid_s: float) -> NDArray[np.float32]:
        """Radiance (height, width) of the frame whose middle row is half exposed at ``mid_s``."""
        height = self._lens.height
        readout_s = self._row_time_s * (height - 1)
        if readout_s == 0.0:
            return renderer.render(self._poses(mid_s), (0, height))
        bands = self._bands(mid_s, readout_s)
        parts = []
        for first, end in pairwise(bands):
            row = (first + end - 1) / 2 - (height - 1) / 2
            parts.append(renderer.render(self._poses(mid_s + row * self._row_time_s), (first, end)))
        return np.concatenate(parts)

    def _poses(self, mid_s: float) -> FloatArray:
        """The poses (k, 4, 4) of the sub-exposures around ``mid_s``."""
        half_s = self._exposure_s / 2
        k = 1
        if half_s > 0.0:
            ends = self._two_poses(mid_s - half_s, mid_s + half_s)
            steps = self._motion_px(ends) / _SUB_EXPOSURE_STEP_PX
            floor_steps = floor_motion_px(ends, self._lens) / _FLOOR_STEP_PX
            k = min(max(1, math.ceil(max(steps, floor_steps))), self._most)
        times = mid_s + self._exposure_s * ((np.arange(k) + 0.5) / k - 0.5)
        return np.array([self._motion.T_base_camera(float(t)) for t in times])

    def _bands(self, mid_s: float, readout_s: float) -> list[int]:
        ends = self._two_poses(mid_s - readout_s / 2, mid_s + readout_s / 2)
        moved = max(self._motion_px(ends), floor_motion_px(ends, self._lens))
        height = self._lens.height
        count = min(max(1, math.ceil(moved / _BAND_STEP_PX)), height)
        return [round(height * i / count) for i in range(count + 1)]

    def _two_poses(self, first_s: float, last_s: float) -> FloatArray:
        return np.array([self._motion.T_base_camera(t) for t in (first_s, last_s)])

    def _motion_px(self, poses: FloatArray) -> float:
        """How far, at most, a point as distant as the target moves between two poses."""
        first, last = poses[0], poses[1]
        depth_m = float(np.linalg.norm(self._target_m - first[:3, 3]))
        points = depth_m * self._rays @ first[:3, :3].T + first[:3, 3]
        seen = (points - last[:3, 3]) @ last[:3, :3]
        moved = seen[:, :2] / seen[:, 2:] - self._rays[:, :2]
        return float(self._lens.focal_px * np.max(np.hypot(moved[:, 0], moved[:, 1])))
