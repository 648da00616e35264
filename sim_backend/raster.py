"""The renderer that needs no OpenGL: exact outlines computed on the processor."""

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from sim_backend.lens import Lens
from sim_backend.raster_board import BoardPainter
from sim_backend.raster_floor import padded
from sim_backend.raster_kernel import TILE, render_rows
from sim_backend.raster_solids import CYLINDER, PACKED, SPHERE
from sim_backend.scene import Cylinder, Scene, Sphere

FloatArray = NDArray[np.float64]

# The floor is smooth compared with outlines: it may move this far between its samples.
_FLOOR_STEP_PX = 1.0


class RasterRenderer:
    """Renders spheres, cylinders and the floor with area coverage; no state but the scene."""

    name = "raster"

    def __init__(self, scene: Scene, lens: Lens) -> None:
        self._lens = lens
        self._rays = lens.ray_table()
        self._scene = scene
        self._solids = np.array([_pack(solid) for solid in scene.solids]).reshape(-1, PACKED)
        self._floor = padded(scene.floor.greys)
        self._board: BoardPainter | None = None
        if scene.board is not None:
            self._board = BoardPainter(scene.board, lens, scene.light, scene.ambient)
        self._helper = ThreadPoolExecutor(1, thread_name_prefix="raster")
        # Compiles the kernels now rather than in the middle of a run.
        self.render(np.eye(4)[None], (0, 1))

    def render(self, T_base_camera: FloatArray, rows: tuple[int, int]) -> NDArray[np.float32]:
        """See ``Renderer.render``."""
        image = np.empty((rows[1] - rows[0], self._lens.width), np.float32)
        poses = np.ascontiguousarray(T_base_camera)
        # Two threads, each with whole tiles: the same picture in less time on two processors.
        half = (rows[1] - rows[0]) // (2 * TILE) * TILE
        upper = self._helper.submit(self._fill, image[:half], rows[0], poses) if half else None
        self._fill(image[half:], rows[0] + half, poses)
        if upper is not None:
            upper.result()
        return image

    def _fill(self, image: NDArray[np.float32], row0: int, poses: FloatArray) -> None:
        """Render the rows from ``row0`` that ``image`` has room for."""
        if self._board is None:
            self._draw(image, row0, poses, self._solids, self._scene.ambient, self._floor)
            return
        behind = self._board.hides(self._solids[:, 1:4], poses[0])
        self._draw(image, row0, poses, self._solids[behind], self._scene.ambient, self._floor)
        self._board.paint(image, row0, poses)
        if not np.all(behind):
            self._lay_over(image, row0, poses, self._solids[~behind])

    def _lay_over(
        self, image: NDArray[np.float32], row0: int, poses: FloatArray, solids: FloatArray
    ) -> None:
        """Draw ``solids`` in front of what ``image`` shows."""
        black = np.zeros_like(self._floor)
        radiance, cover = np.empty_like(image), np.empty_like(image)
        self._draw(radiance, row0, poses, solids, self._scene.ambient, black)
        # White ones, evenly lit, in front of black: their share of each pixel.
        white = solids.copy()
        white[:, 9] = 1.0
        self._draw(cover, row0, poses, white, 1.0, black)
        image[:] = (1.0 - cover) * image + radiance

    def _draw(
        self,
        image: NDArray[np.float32],
        row0: int,
        poses: FloatArray,
        solids: FloatArray,
        ambient: float,
        floor: NDArray[np.float32],
    ) -> None:
        render_rows(
            image,
            row0,
            self._rays,
            self._lens.focal_px,
            poses,
            solids,
            self._scene.light,
            ambient,
            floor,
            self._scene.floor.texel_m,
            np.float32(floor.mean()),
            self._floor_poses(poses),
        )

    def close(self) -> None:
        """End the helping thread."""
        self._helper.shutdown()

    def _floor_poses(self, poses: FloatArray) -> NDArray[np.int64]:
        """Which of the poses suffice for the floor, evenly spread."""
        k = len(poses)
        if k == 1:
            return np.zeros(1, np.int64)
        n = min(k, max(1, math.ceil(floor_motion_px(poses, self._lens) / _FLOOR_STEP_PX)))
        return ((np.arange(n) + 0.5) * k / n).astype(np.int64)


def floor_motion_px(poses: FloatArray, lens: Lens) -> float:
    """How far the floor in the middle of the image moves from the first to the last pose."""
    first, last = poses[0], poses[-1]
    if first[2, 2] > -0.05 or first[2, 3] <= 0.0:
        return 0.0  # looking at the horizon
    point = first[:3, 3] - first[2, 3] / first[2, 2] * first[:3, 2]
    seen = last[:3, :3].T @ (point - last[:3, 3])
    return float(lens.focal_px * np.hypot(seen[0], seen[1]) / seen[2])


def _pack(solid: Sphere | Cylinder) -> FloatArray:
    row = np.zeros(PACKED)
    row[7], row[9] = solid.radius_m, solid.albedo_grey
    if isinstance(solid, Sphere):
        row[0], row[1:4] = SPHERE, solid.centre_m
    else:
        row[0], row[1:4], row[4:7] = CYLINDER, solid.middle_m, solid.axis
        row[8] = solid.half_length_m
    return row
