"""The page's 3D scene: the rig, the camera and its path, the target as it is estimated."""

import numpy as np
import viser
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig.config_safety import SafetyConfig
from rig.page.state import PageState
from rig.recorded.setup import RunSetup

FloatArray = NDArray[np.float64]
Colour = tuple[int, int, int]

_PATH: Colour = (31, 95, 168)
_TARGET: Colour = (209, 73, 91)
_FRAME: Colour = (90, 100, 112)
_AXIS_SHOWN_M = 0.24  # length drawn of a cylinder
_PATH_STEP_M = 5e-4  # the path gets a point whenever the camera has moved by this
_PATH_POINTS = 4000
_PATH_EVERY_S = 0.2  # the whole path is sent each time
_DEEP_M = 0.06  # of the camera's frustum
# Three standard deviations are drawn where the estimator states them.
_STATED_FACTOR = 3.0


class Scene:
    """Everything in the base frame, which is the world's."""

    def __init__(self, server: viser.ViserServer, setup: RunSetup, safety: SafetyConfig) -> None:
        self._scene = server.scene
        self._T_tool_camera = setup.T_tool_camera
        self._path: list[FloatArray] = []
        self._drawn_path = 0
        self._path_at_s = float("-inf")
        self._cylinder = setup.target == "cylinder"
        self._aimed = False
        self._server = server
        self._rig(setup, safety)
        self._target, self._spread = self._shape("target", None), self._shape("spread", 0.25)

    def update(self, state: PageState) -> None:
        """Move everything to where ``state`` has it."""
        if state.T_base_tool is None:
            return
        T_base_tool = np.eye(4)
        T_base_tool[:3] = np.reshape(state.T_base_tool, (3, 4))
        T_base_camera = T_base_tool @ self._T_tool_camera
        _place(self._tool, T_base_tool)
        _place(self._camera, T_base_camera)
        self._draw_mount(T_base_tool, T_base_camera)
        self._draw_path(T_base_camera[:3, 3], state.elapsed_s)
        self._draw_target(state, T_base_camera)

    def restart(self) -> None:
        """Forget the path: a past run was wound back."""
        self._path.clear()
        self._drawn_path = 0
        self._path_at_s = float("-inf")

    def _rig(self, setup: RunSetup, safety: SafetyConfig) -> None:
        scene = self._scene
        scene.set_up_direction("+z")
        # Neither shadows nor reflections: many a machine draws this by software.
        scene.configure_default_lights(cast_shadow=False)
        scene.configure_environment_map(None)
        scene.add_light_ambient("/light", intensity=1.2)
        height_m = 0.0 if safety.table is None else safety.table.offset_m
        scene.add_grid("/floor", 2.0, 2.0, cell_size=0.1, position=(0.0, 0.0, height_m))
        scene.add_frame("/base", axes_length=0.1, axes_radius=0.003)
        scene.add_label("/base/name", "base")
        self._tool = scene.add_frame("/tool", axes_length=0.05, axes_radius=0.002)
        lens = setup.intrinsics
        # Images are about as wide and high as their principal point says.
        width_px, height_px = 2.0 * lens.cx_px + 1.0, 2.0 * lens.cy_px + 1.0
        self._camera = scene.add_camera_frustum(
            "/camera",
            fov=2.0 * float(np.arctan2(0.5 * height_px, lens.fy_px)),
            aspect=width_px / height_px,
            scale=_DEEP_M,
            thickness=2.0,
            thickness_units="screen",
            color=_PATH,
        )
        self._mount = self._lines("/mount", _FRAME)
        self._path_lines = self._lines("/path", _PATH)
        self._box(safety)

    def _box(self, safety: SafetyConfig) -> None:
        low, high = np.array(safety.workspace_min_m), np.array(safety.workspace_max_m)
        corners = np.array([[i >> k & 1 for k in range(3)] for i in range(8)])
        edges = [(i, i | 1 << k) for i in range(8) for k in range(3) if not i >> k & 1]
        points = low + corners * (high - low)
        lines = self._lines("/workspace", (205, 210, 216))
        lines.points = points[np.array(edges)].astype(np.float32)
        lines.thickness = 1.0

    def _lines(self, name: str, colour: Colour) -> viser.LineSegmentsHandle:
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        return self._scene.add_line_segments(
            name, nothing, colour, thickness=3.0, thickness_units="screen"
        )

    def _shape(
        self, name: str, opacity: float | None
    ) -> viser.IcosphereHandle | viser.CylinderHandle:
        """A target of unit radius, to be scaled."""
        if self._cylinder:
            return self._scene.add_cylinder(
                f"/{name}", 1.0, 1.0, _TARGET, opacity=opacity, visible=False
            )
        return self._scene.add_icosphere(f"/{name}", 1.0, _TARGET, opacity=opacity, visible=False)

    def _draw_mount(self, T_base_tool: FloatArray, T_base_camera: FloatArray) -> None:
        ends = np.stack([T_base_tool[:3, 3], T_base_camera[:3, 3]])
        self._mount.points = ends[None].astype(np.float32)

    def _draw_path(self, camera_m: FloatArray, elapsed_s: float) -> None:
        if not self._path or np.linalg.norm(camera_m - self._path[-1]) >= _PATH_STEP_M:
            self._path.append(camera_m)
        if len(self._path) > _PATH_POINTS:
            del self._path[1::2]  # coarser, but whole
        due = elapsed_s - self._path_at_s >= _PATH_EVERY_S
        if len(self._path) > 1 and len(self._path) != self._drawn_path and due:
            points = np.array(self._path, dtype=np.float32)
            segments = np.stack([points[:-1], points[1:]], axis=1)
            self._path_lines.colors = np.full(segments.shape, _PATH, np.uint8)
            self._path_lines.points = segments
            self._drawn_path, self._path_at_s = len(self._path), elapsed_s

    def _draw_target(self, state: PageState, T_base_camera: FloatArray) -> None:
        known = state.radius_m is not None and state.s is not None
        self._target.visible = known
        self._spread.visible = known and bool(state.spread_m)
        if state.radius_m is None or state.s is None:
            return
        R, p = T_base_camera[:3, :3], T_base_camera[:3, 3]
        P0 = R @ (np.array(state.s) * state.radius_m) + p
        factor = _STATED_FACTOR if state.spread_stated else 1.0
        outer_m = state.radius_m + factor * (state.spread_m or 0.0)
        for shape, radius_m in ((self._target, state.radius_m), (self._spread, outer_m)):
            shape.position = tuple(P0)
            shape.scale = radius_m
            if self._cylinder and state.axis is not None:
                shape.scale = (radius_m, radius_m, _AXIS_SHOWN_M)
                shape.wxyz = _towards(R @ np.array(state.axis))
        if not self._aimed:  # once: from then on the view is the user's
            self._aim(P0, p)

    def _aim(self, target_m: FloatArray, camera_m: FloatArray) -> None:
        """Look at target and camera from the side."""
        self._aimed = True
        middle = 0.5 * (target_m + camera_m)
        distance_m = 1.3 * float(np.linalg.norm(camera_m - target_m)) + 0.2
        eye = middle + distance_m * np.array([0.6, -0.75, 0.25])
        initial = self._server.initial_camera
        initial.position, initial.look_at = tuple(eye), tuple(middle)
        for client in self._server.get_clients().values():
            client.camera.position, client.camera.look_at = tuple(eye), tuple(middle)


def _place(handle: viser.SceneNodeHandle, T: FloatArray) -> None:
    handle.position = tuple(T[:3, 3])
    handle.wxyz = _wxyz(Rotation.from_matrix(T[:3, :3]))


def _towards(axis: FloatArray) -> tuple[float, float, float, float]:
    """The rotation that takes z, along which viser's cylinders lie, to ``axis``."""
    rotation, _ = Rotation.align_vectors(axis[None], np.array([[0.0, 0.0, 1.0]]))
    return _wxyz(rotation)


def _wxyz(rotation: Rotation) -> tuple[float, float, float, float]:
    x, y, z, w = (float(value) for value in rotation.as_quat())
    return w, x, y, z
