"""The planned poses as a picture: board, frustums, workspace, and what the image will cover."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # a file, on machines without a screen too

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from drivers.errors import ConfigError
from rig.calibration.board import BoardConfig
from rig.calibration.hand_eye_model import board_seen
from rig.calibration.pose_candidates import corners_in_view
from rig.calibration.projection import from_vector, project
from rig.calibration_run.plan_ahead import Foresight
from rig.config_safety import SafetyConfig

FloatArray = NDArray[np.float64]

_FIRST, _LATER, _START = "#1f5fa8", "#d9822b", "black"
_WALL = "#aa3333"
_FRUSTUM_M = 0.06
_ROOM_M = 0.08  # around what is drawn
_EDGES = ((0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (2, 6),
          (3, 7))  # fmt: skip


def draw_plan(
    path: Path, title: str, foresight: Foresight, board: BoardConfig, safety: SafetyConfig
) -> None:
    """Draw into ``path`` (PNG); raises ConfigError where that cannot be written."""
    figure = plt.figure(figsize=(15, 9.5))
    figure.suptitle(title)
    grid = figure.add_gridspec(
        2, 3, left=0.03, right=0.98, bottom=0.07, top=0.92, wspace=0.22, hspace=0.25
    )
    room = figure.add_subplot(grid[:, :2], projection="3d")
    assert isinstance(room, Axes3D)
    _draw_room(room, foresight, board, safety)
    _draw_coverage(figure.add_subplot(grid[0, 2]), foresight)
    _draw_gain(figure.add_subplot(grid[1, 2]), foresight)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=90, format="png")
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {error}") from error
    finally:
        plt.close(figure)


def _tools(foresight: Foresight) -> tuple[FloatArray, list[str]]:
    """All tool poses (k, 4, 4) in order, the first look first, and their colours."""
    poses = [foresight.scene.T_base_tool]
    poses += [pose.T_base_tool for pose in (*foresight.first, *foresight.later)]
    colours = [_START] + [_FIRST] * len(foresight.first) + [_LATER] * len(foresight.later)
    return np.array(poses), colours


def _draw_room(
    axes: Axes3D, foresight: Foresight, board: BoardConfig, safety: SafetyConfig
) -> None:
    state = foresight.scene.state
    tools, colours = _tools(foresight)
    width, height = board.size_m
    outline = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]])
    sheet = _placed(state.T_base_board, np.column_stack([outline, np.zeros(5)]))
    axes.plot(*sheet.T, color="black", linewidth=2)
    corners = _placed(state.T_base_board, foresight.scene.points_m)
    axes.plot(*corners.T, color="black", marker=".", markersize=3, linestyle="")
    rays = _frustum(foresight)
    for number, (T, colour) in enumerate(zip(tools, colours, strict=True)):
        camera = T @ state.T_tool_camera
        tip, *ends = _placed(camera, np.vstack([np.zeros(3), rays]))
        for k in range(4):
            axes.plot(*np.array([tip, ends[k], ends[(k + 1) % 4]]).T, color=colour, linewidth=0.8)
        axes.plot(*np.array([T[:3, 3], tip]).T, color="0.6", linewidth=0.8)
        axes.text(*tip, str(number + 1), fontsize=7, color=colour)
    axes.plot(
        *tools[:, :3, 3].T, color="0.75", linewidth=0.6, linestyle=":", label="the tool's way"
    )
    for colour, name in (
        (_START, "first look"),
        (_FIRST, "planned from nominal values"),
        (_LATER, "as they would follow; planned anew when more is known"),
    ):
        axes.plot([], [], color=colour, label=name)
    drawn = np.vstack([sheet, tools[:, :3, 3], (tools @ state.T_tool_camera)[:, :3, 3]])
    _fit(axes, drawn)
    _draw_box(axes, np.array(safety.workspace_min_m), np.array(safety.workspace_max_m))
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", title="in the arm's base frame")
    axes.plot([], [], color=_WALL, label="walls of the workspace, where they are near")
    axes.legend(loc="upper left", bbox_to_anchor=(-0.02, 0.06), fontsize=8)


def _fit(axes: Axes3D, points: FloatArray) -> None:
    low, high = points.min(axis=0) - _ROOM_M, points.max(axis=0) + _ROOM_M
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect((high - low).tolist())


def _draw_box(axes: Axes3D, low: FloatArray, high: FloatArray) -> None:
    """The workspace's walls, as far as they are near what is drawn."""
    shown_low = np.array([axes.get_xlim()[0], axes.get_ylim()[0], axes.get_zlim()[0]])
    shown_high = np.array([axes.get_xlim()[1], axes.get_ylim()[1], axes.get_zlim()[1]])
    near = [np.clip(low, shown_low, shown_high), np.clip(high, shown_low, shown_high)]
    ends = np.array([[near[(k >> i) & 1][i] for i in range(3)] for k in range(8)])
    for a, b in _EDGES:
        # An edge that the picture's border cuts away is no wall.
        axis = int(np.flatnonzero(((a ^ b) >> np.arange(3)) & 1)[0])
        others = [i for i in range(3) if i != axis]
        wall = all(ends[a, i] in (low[i], high[i]) for i in others)
        style = {"color": _WALL, "linewidth": 1.2} if wall else {"color": "0.9", "linewidth": 0.6}
        axes.plot(*ends[[a, b]].T, **style)


def _draw_coverage(axes: Axes, foresight: Foresight) -> None:
    scene = foresight.scene
    tools, colours = _tools(foresight)
    T = board_seen(scene.state, tools)
    pixels = project(
        scene.state.intrinsics, T, np.broadcast_to(scene.points_m, (len(T), *scene.points_m.shape))
    ).pixels
    seen = corners_in_view(tools, scene.state, scene.points_m, scene.size, 0.0)
    for colour in (_LATER, _FIRST, _START):
        mine = np.array([one == colour for one in colours])
        u, v = pixels[mine][seen[mine]].T
        axes.plot(u, v, color=colour, marker=".", markersize=4, linestyle="")
    axes.set(
        xlim=(0, scene.size[0]), ylim=(scene.size[1], 0), aspect="equal",
        title="corners expected in the image [px]",
    )  # fmt: skip


def _draw_gain(axes: Axes, foresight: Foresight) -> None:
    poses = [*foresight.first, *foresight.later]
    colours = [_FIRST] * len(foresight.first) + [_LATER] * len(foresight.later)
    numbers = np.arange(2, len(poses) + 2)
    axes.bar(numbers, [pose.gain for pose in poses], color=colours)
    axes.set(title="what each pose adds", xlabel="pose, in the order of the way", ylabel="bit")
    axes.set_yscale("symlog", linthresh=1.0)


def _frustum(foresight: Foresight) -> FloatArray:
    width, height = foresight.scene.size
    ends = np.array([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]], float)
    rays = from_vector(foresight.scene.state.intrinsics).normalise(ends)
    return np.asarray(_FRUSTUM_M * np.column_stack([rays, np.ones(4)]))


def _placed(T: FloatArray, points: FloatArray) -> FloatArray:
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])
