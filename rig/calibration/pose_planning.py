"""Which poses to look at the board from: those that add most to what is not known yet."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye_model import (
    BOARD,
    CAMERA,
    INTRINSICS,
    UNKNOWNS,
    Noise,
    linearise,
    whitener,
)
from rig.calibration.pose_candidates import (
    Candidates,
    PoseLimits,
    Reachable,
    Scene,
    StartDoubt,
    corners_in_view,
    draw_candidates,
)
from rig.calibration.views import Stack

FloatArray = NDArray[np.float64]

_DRAWN = 1500
_KEPT = 400
# What is taken to be known before: standard deviations of hand-eye, board and intrinsics.
_BEFORE = np.concatenate(
    [
        np.repeat([0.05, 0.2], 3),
        np.repeat([0.05, 0.2], 3),
        [100.0, 100.0, 50.0, 50.0],
        [0.3, 0.5, 5e-3, 5e-3, 1.0],
    ]
)
_NOISE = Noise(0.1, 1e-4, 2e-4)


@dataclass(frozen=True, slots=True)
class PlannedPose:
    """A pose to look from, and why."""

    T_base_tool: FloatArray  # (4, 4)
    gain: float  # halvings of the uncertainty's volume that its view adds, in bits
    corners: int  # expected in view
    tilt_rad: float  # of the board against the optical axis
    distance_m: float


def plan_poses(
    scene: Scene,
    count: int,
    limits: PoseLimits | None = None,
    doubt: StartDoubt | None = None,
    taken: Sequence[FloatArray] = (),
    reachable: Reachable | None = None,
    seed: int = 1,
) -> list[PlannedPose]:
    """Up to ``count`` poses, each the one that adds most to those before it and to ``taken``.

    ``taken`` are poses (4, 4) already looked from: after a first handful, plan the rest anew
    with better start values and less ``doubt``. A pose that is not ``reachable`` is passed
    over. The same seed gives the same poses. Raises CalibrationError when fewer than six poses
    show enough of the board within the limits.
    """
    limits, doubt = limits or PoseLimits(), doubt or StartDoubt()
    random = np.random.default_rng([seed, len(taken)])
    found = draw_candidates(scene, limits, doubt, _DRAWN, random)
    found = Candidates(found.T_base_tool[:_KEPT], found.seen[:_KEPT])
    known = np.diag(_BEFORE**-2.0)
    if len(taken):
        tools = np.array(taken)
        seen = corners_in_view(tools, scene.state, scene.points_m, scene.size, 2.0)
        known = known + _information(scene, tools, seen).sum(axis=0)
    chosen = _greedy(scene, found, known, count, reachable)
    if len(chosen) < min(count, 6):
        raise CalibrationError(
            f"only {len(chosen)} poses show enough of the board within the limits "
            f"({len(found.T_base_tool)} of {_DRAWN} tried did, the others left the view or the "
            "workspace): start with the board nearer to the middle of the image, or widen "
            "workspace, distances, tilt or turn"
        )
    return chosen


def _greedy(
    scene: Scene, found: Candidates, known: FloatArray, count: int, reachable: Reachable | None
) -> list[PlannedPose]:
    """Always the candidate that adds most to what is ``known`` (21, 21) with those before it."""
    information = _information(scene, found.T_base_tool, found.seen)
    chosen: list[PlannedPose] = []
    left = np.ones(len(information), dtype=bool)
    while len(chosen) < count and left.any():
        before = np.linalg.slogdet(known)[1]
        after = np.linalg.slogdet(known + information[left])[1]
        best = int(np.flatnonzero(left)[np.argmax(after)])
        left[best] = False
        T = found.T_base_tool[best]
        if reachable is not None and not reachable(T):
            continue
        known = known + information[best]
        gain = 0.5 * (float(np.max(after)) - float(before)) / np.log(2.0)
        chosen.append(_described(T, gain, int(found.seen[best].sum()), scene))
    return chosen


def tour(poses: Sequence[PlannedPose], T_base_tool: FloatArray) -> list[PlannedPose]:
    """The poses in an order of short ways, from ``T_base_tool`` always to the nearest one."""
    rest, here, out = list(poses), T_base_tool, []
    while rest:
        moves = se3.log(se3.inverse(here) @ np.array([one.T_base_tool for one in rest]))
        # A radian of turning takes about as long as 0.3 m.
        ways = np.linalg.norm(moves[:, :3], axis=1) + 0.3 * np.linalg.norm(moves[:, 3:], axis=1)
        nearest = rest.pop(int(np.argmin(ways)))
        out.append(nearest)
        here = nearest.T_base_tool
    return out


def _information(scene: Scene, tools: FloatArray, seen: NDArray[np.bool_]) -> FloatArray:
    """What a view from each pose says about hand-eye, board and intrinsics: (k, 21, 21)."""
    k, n = seen.shape
    points = np.broadcast_to(scene.points_m, (k, n, 3))
    corners = Stack(points, np.zeros((k, n, 2)), seen.astype(float))
    linear = linearise(scene.state, tools, corners)
    free = np.zeros(UNKNOWNS, dtype=bool)
    free[CAMERA] = free[BOARD] = free[INTRINSICS] = True
    J = whitener(linear, _NOISE)(linear.by_step[..., free])
    return np.asarray(np.swapaxes(J, 1, 2) @ J, dtype=float)


def _described(T: FloatArray, gain: float, corners: int, scene: Scene) -> PlannedPose:
    state = scene.state
    seen = se3.inverse(T @ state.T_tool_camera) @ state.T_base_board
    middle = seen[:3, :3] @ scene.points_m.mean(axis=0) + seen[:3, 3]
    tilt = float(np.arccos(min(abs(seen[2, 2]), 1.0)))
    return PlannedPose(T, gain, corners, tilt, float(np.linalg.norm(middle)))
