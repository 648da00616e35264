"""Ground truth: for tests and the report's error figures only, never for the loop."""

import numpy as np
from numpy.typing import NDArray

from sim_backend.board import Board
from sim_backend.motion import CameraMotion
from sim_backend.scene import Cylinder, Sphere
from sim_backend.world import World

FloatArray = NDArray[np.float64]


class Truth:
    """What the estimator is trying to find out, at any instant of the last two minutes.

    Every method raises ValueError for an instant before that span or after the present, and
    where a radius is needed but the target is a board.
    """

    def __init__(
        self, target: Sphere | Cylinder | Board, world: World, motion: CameraMotion
    ) -> None:
        self._target = target
        self._world = world
        self._motion = motion

    @property
    def radius_m(self) -> float:
        """The target's radius."""
        return self._round().radius_m

    def T_base_camera(self, t_s: float) -> FloatArray:
        """The camera's true pose (4, 4)."""
        self._world.sync()
        return self._motion.T_base_camera(t_s)

    def twist_camera(self, t_s: float) -> FloatArray:
        """The camera's true twist (6,), in its own axes."""
        self._world.sync()
        return self._motion.twist_camera(t_s)

    def s(self, t_s: float) -> FloatArray:
        """P0 / R (3,): the sphere's centre, or the axis point nearest the camera, in radii."""
        T = self.T_base_camera(t_s)
        target = self._round()
        if isinstance(target, Sphere):
            P0 = T[:3, :3].T @ (target.centre_m - T[:3, 3])
        else:
            a = T[:3, :3].T @ target.axis
            Q = T[:3, :3].T @ (target.middle_m - T[:3, 3])
            P0 = Q - a * (a @ Q)
        scaled: FloatArray = P0 / target.radius_m
        return scaled

    def axis(self, t_s: float) -> FloatArray | None:
        """The cylinder's unit axis (3,) in the camera frame; None for a sphere."""
        target = self._round()
        if isinstance(target, Sphere):
            return None
        a: FloatArray = self.T_base_camera(t_s)[:3, :3].T @ target.axis
        return a

    def _round(self) -> Sphere | Cylinder:
        if isinstance(self._target, Board):
            raise ValueError("the target is a calibration board: it has no radius and no axis")
        return self._target
