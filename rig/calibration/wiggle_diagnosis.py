"""From motions made and motions seen to what is wrong between arm, tool and camera."""

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration.wiggle_motion import Glimpse, fitted_lever

FloatArray = NDArray[np.float64]

_STILL = 0.2  # of the motion made: less was hardly any
_NEAR_AXES = 0.35  # entries this near to 0 and ±1 make a change of axes
_SCALE = 0.04
_TURN_RAD = np.radians(1.5)
_LEVER_M = 2e-3
_LEVER_LEFT_PX = 1.0  # a lever arm explains the turns when it leaves no more than this
_LETTERS = "xyz"


def diagnose(shifts: list[Glimpse], turns: list[Glimpse]) -> list[str]:
    """What explains the motions seen: exchanged axes, a sign, a scale, a turn, a lever arm.

    ``shifts`` are translations along the tool's axes, ``turns`` turns about them. The
    translations show how the frames are turned, whatever the lever arm; the lever arm is looked
    for where they are right. Empty when nothing of this kind stands out.
    """
    found = _of_map(
        np.array([one.tool_moved[:3] for one in shifts]).reshape(-1, 3),
        np.array([one.seen_linear() for one in shifts]).reshape(-1, 3),
        "moving along",
        "the arm's unit of length, and the board's square",
    )
    if not found and turns:
        lever, left_px = fitted_lever(turns)
        if float(np.linalg.norm(lever)) > _LEVER_M and left_px < _LEVER_LEFT_PX:
            mm = 1e3 * lever
            return [
                f"the camera sits ({mm[0]:.1f}, {mm[1]:.1f}, {mm[2]:.1f}) mm, in tool axes, from "
                "where the calibration has it: check the TCP set on the arm, then repeat the "
                "hand-eye step"
            ]
    found += _of_map(
        np.array([one.tool_moved[3:] for one in turns]).reshape(-1, 3),
        np.array([one.seen_turn() for one in turns]).reshape(-1, 3),
        "turning about",
        "the arm's unit of angle, and the focal length",
    )
    return found


def _of_map(made: FloatArray, seen: FloatArray, doing: str, unit: str) -> list[str]:
    """What the map from motions made (k, 3) to motions seen says; nothing for too few."""
    if len(made) < 3:
        return []
    strength = np.linalg.svd(made, compute_uv=False)
    if strength[2] < 0.2 * strength[0]:
        return []
    M = np.asarray(np.linalg.lstsq(made, seen, rcond=None)[0].T, dtype=float)
    if np.linalg.norm(M) < _STILL:
        return [
            f"the image hardly moves while {doing} the tool's axes: is the camera on the tool "
            "that moves, and is the image live?"
        ]
    size = max(float(np.cbrt(abs(np.linalg.det(M)))), 0.1)
    axes = np.round(M / size)
    exchange = all(np.array_equal(np.abs(axes).sum(axis=k), np.ones(3)) for k in (0, 1))
    near = float(np.max(np.abs(M / size - axes))) < _NEAR_AXES
    if exchange and near and not np.array_equal(axes, np.eye(3)):
        return [_exchange(axes, doing)]
    return _scale(size, doing, unit) + _turn(M, doing)


def _exchange(axes: FloatArray, doing: str) -> str:
    parts = []
    for i in range(3):
        j = int(np.argmax(np.abs(axes[:, i])))
        if i != j or axes[j, i] < 0:
            sign = "−" if axes[j, i] < 0 else "+"
            parts.append(f"{doing} +{_LETTERS[i]} looks like {sign}{_LETTERS[j]}")
    mirrored = np.linalg.det(axes) < 0
    cause = (
        "one axis has the wrong sign, two are exchanged, or the image is mirrored"
        if mirrored
        else "the tool's frame is turned against the one the calibration was made in"
    )
    return f"{', '.join(parts)}: {cause}"


def _scale(size: float, doing: str, unit: str) -> list[str]:
    if abs(size - 1.0) <= _SCALE:
        return []
    return [f"{doing} an axis looks {size:.3f} times as large as the arm says: check {unit}"]


def _turn(M: FloatArray, doing: str) -> list[str]:
    U, _, Vt = np.linalg.svd(M)
    turn = se3.rotation_vectors(U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt)
    angle = float(np.linalg.norm(turn))
    if angle <= _TURN_RAD:
        return []
    axis = turn / angle
    return [
        f"{doing} the tool's axes, the camera seems turned against the calibration by "
        f"{np.degrees(angle):.1f}° about the tool's ({axis[0]:.2f}, {axis[1]:.2f}, {axis[2]:.2f}): "
        "was it moved on the tool, or was T_tool_camera taken for another tool frame or for its "
        "inverse?"
    ]
