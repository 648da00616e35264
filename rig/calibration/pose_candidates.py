"""Camera poses from which the board can be seen, drawn at random within limits."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial.transform import Rotation

from rig.calibration import se3
from rig.calibration.hand_eye_model import State, board_seen
from rig.calibration.projection import project
from rig.config_section import Finite, NotNegative, Positive, Section

FloatArray = NDArray[np.float64]
# Whether the arm can stand there and get there; given T_base_tool (4, 4).
Reachable = Callable[[FloatArray], bool]

_LEAST_DEPTH_M = 0.02


class PoseLimits(Section):
    """Where the camera may go to look at the board."""

    min_distance_m: Positive = 0.25  # from the board's middle; the lens' near focus
    max_distance_m: Positive = 0.55
    max_tilt_rad: Annotated[float, Field(gt=0, le=1.2)] = 0.75  # against the board's normal
    max_spin_rad: Annotated[float, Field(ge=0, le=3.2)] = 0.9  # about the optical axis
    max_turn_rad: Annotated[float, Field(gt=0, le=3.2)] = 1.2  # of the tool from the first look
    workspace_min_m: tuple[Finite, Finite, Finite] = (-2.0, -2.0, 0.05)  # of the tool, in base
    workspace_max_m: tuple[Finite, Finite, Finite] = (2.0, 2.0, 2.0)
    margin_px: NotNegative = 10.0
    min_corners: Annotated[int, Field(ge=6)] = 14


class StartDoubt(Section):
    """How wrong the values may be that the poses are planned with."""

    tool_camera_m: NotNegative = 0.010  # standard deviations
    tool_camera_rad: NotNegative = 0.05
    focal: NotNegative = 0.03  # of the focal length


@dataclass(frozen=True, slots=True)
class Candidates:
    """Poses that show enough of the board, also if the start values are somewhat wrong."""

    T_base_tool: FloatArray  # (k, 4, 4)
    seen: NDArray[np.bool_]  # (k, n) the corners expected in view


@dataclass(frozen=True, slots=True)
class Scene:
    """What is known when poses are planned."""

    state: State  # T_tool_camera, T_base_board and intrinsics, perhaps rough
    points_m: FloatArray  # (n, 3) the board's corners
    size: tuple[int, int]  # width, height of the image
    T_base_tool: FloatArray  # (4, 4) of the first look


def draw_candidates(
    scene: Scene, limits: PoseLimits, doubt: StartDoubt, count: int, random: np.random.Generator
) -> Candidates:
    """The usable ones of ``count`` random poses; the board's middle may be anywhere in view."""
    state, middle = scene.state, scene.points_m.mean(axis=0)
    board = state.T_base_board
    T_base_camera = scene.T_base_tool @ state.T_tool_camera
    R_first = board[:3, :3].T @ T_base_camera[:3, :3]  # R_board_camera
    # OpenCV's board has its z away from the viewer, but a definition may differ: as it was seen.
    normal = np.array([0.0, 0.0, np.sign(R_first[2, 2]) or 1.0])
    upright = _turn_between(R_first[:, 2], normal) @ R_first
    lean, azimuth = (
        limits.max_tilt_rad * random.uniform(0, 1, count) ** 0.5,
        random.uniform(-np.pi, np.pi, count),
    )
    axis = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(count)], axis=1)
    spin = random.uniform(-limits.max_spin_rad, limits.max_spin_rad, count)
    leaned = Rotation.from_rotvec(lean[:, None] * axis).as_matrix()
    spun = Rotation.from_rotvec(spin[:, None] * np.array([0.0, 0.0, 1.0])).as_matrix()
    width, height = scene.size
    fx, fy, cx, cy = state.intrinsics[:4]
    aim = random.uniform(0.15, 0.85, (count, 2)) * [width, height]
    ray = np.column_stack([(aim - [cx, cy]) / [fx, fy], np.ones(count)])
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    R = leaned @ upright @ spun
    distance = random.uniform(limits.min_distance_m, limits.max_distance_m, count)
    shift = middle - distance[:, None] * (R @ ray[..., None])[..., 0]
    tools = board @ se3.pose(R, shift) @ se3.inverse(state.T_tool_camera)
    tools = tools[_within(tools, scene.T_base_tool, limits)]
    return _seen_for_sure(tools, scene, limits, doubt, random)


def corners_in_view(
    tools: FloatArray, state: State, points_m: FloatArray, size: tuple[int, int], margin_px: float
) -> NDArray[np.bool_]:
    """Which corners (k, n) lie in the image and in front of the camera."""
    T = board_seen(state, tools)
    got = project(state.intrinsics, T, np.broadcast_to(points_m, (len(T), *points_m.shape)))
    low, high = margin_px, np.array(size) - 1 - margin_px
    inside = np.all((got.pixels >= low) & (got.pixels <= high), axis=2)
    return np.asarray(inside & (got.depth_m > _LEAST_DEPTH_M))


def _within(tools: FloatArray, first: FloatArray, limits: PoseLimits) -> NDArray[np.bool_]:
    place = tools[:, :3, 3]
    box = np.all((place >= limits.workspace_min_m) & (place <= limits.workspace_max_m), axis=1)
    turn = se3.rotation_vectors(first[:3, :3].T @ tools[:, :3, :3])
    return np.asarray(box & (np.linalg.norm(turn, axis=1) <= limits.max_turn_rad))


def _seen_for_sure(
    tools: FloatArray,
    scene: Scene,
    limits: PoseLimits,
    doubt: StartDoubt,
    random: np.random.Generator,
) -> Candidates:
    """Those that show enough corners under nearly all start values that are still possible.

    Each possible hand-eye comes with the board where the first look then saw it.
    """
    state = scene.state
    T_camera_board = board_seen(state, scene.T_base_tool[None])[0]
    expected = corners_in_view(tools, state, scene.points_m, scene.size, limits.margin_px)
    spread = np.repeat([doubt.tool_camera_m, doubt.tool_camera_rad], 3)
    trials = 12
    enough = np.zeros(len(tools))
    for _ in range(trials):
        X = state.T_tool_camera @ se3.exp(spread * random.standard_normal(6))
        stretch = 1.0 + doubt.focal * random.standard_normal()
        intrinsics = state.intrinsics.copy()
        intrinsics[:2] *= stretch
        farther = T_camera_board.copy()
        farther[:3, 3] *= [1.0, 1.0, stretch]  # the same image through a longer lens
        other = State(X, scene.T_base_tool @ X @ farther, intrinsics)
        seen = corners_in_view(tools, other, scene.points_m, scene.size, 2.0)
        enough += seen.sum(axis=1) >= limits.min_corners
    good = (expected.sum(axis=1) >= limits.min_corners) & (enough >= trials - 1)
    return Candidates(tools[good], expected[good])


def _turn_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """The shortest rotation (3, 3) that takes the unit vector ``a`` to ``b``."""
    return np.asarray(Rotation.align_vectors(b[None], a[None])[0].as_matrix(), dtype=float)
