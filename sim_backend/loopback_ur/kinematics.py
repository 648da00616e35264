"""The UR5e's kinematics from its published Denavit-Hartenberg parameters (standard convention)."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

A_M = (0.0, -0.425, -0.3922, 0.0, 0.0, 0.0)
D_M = (0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996)
ALPHA_RAD = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)

# Elbow up, tool pointing down: where the emulated arm starts.
HOME_Q = np.array([0.0, -math.pi / 2, -math.pi / 2, -math.pi / 2, math.pi / 2, 0.0])

# Joint speeds that a smallest singular value below this would need are damped away.
_DAMPED_BELOW = 0.03


def link_frames(q: FloatArray) -> list[FloatArray]:
    """T_base_link (4, 4) of the base and after each of the six joints."""
    T = np.eye(4)
    frames = [T]
    for i in range(6):
        ct, st = math.cos(q[i]), math.sin(q[i])
        ca, sa = math.cos(ALPHA_RAD[i]), math.sin(ALPHA_RAD[i])
        step = np.array(
            [
                [ct, -st * ca, st * sa, A_M[i] * ct],
                [st, ct * ca, -ct * sa, A_M[i] * st],
                [0.0, sa, ca, D_M[i]],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
        T = T @ step
        frames.append(T)
    return frames


def tool_pose(q: FloatArray, T_flange_tool: FloatArray) -> FloatArray:
    """T_base_tool (4, 4) at joint positions ``q`` (6,) in rad."""
    pose: FloatArray = link_frames(q)[-1] @ T_flange_tool
    return pose


def pose_and_jacobian(q: FloatArray, T_flange_tool: FloatArray) -> tuple[FloatArray, FloatArray]:
    """T_base_tool (4, 4), and J (6, 6): joint rates → (v, ω) of the tool in base axes."""
    frames = link_frames(q)
    T = frames[-1] @ T_flange_tool
    axes = np.array([frame[:3, 2] for frame in frames[:6]])  # (6, 3)
    arms = T[:3, 3] - np.array([frame[:3, 3] for frame in frames[:6]])
    J = np.empty((6, 6))
    J[0] = axes[:, 1] * arms[:, 2] - axes[:, 2] * arms[:, 1]
    J[1] = axes[:, 2] * arms[:, 0] - axes[:, 0] * arms[:, 2]
    J[2] = axes[:, 0] * arms[:, 1] - axes[:, 1] * arms[:, 0]
    J[3:] = axes.T
    return T, J


def joint_rates(J: FloatArray, twist_base: FloatArray) -> FloatArray:
    """Joint rates (6,) for a tool twist (6,) in base axes, damped close to a singularity."""
    u, s, vt = np.linalg.svd(J)
    damping2 = 0.0 if s[-1] >= _DAMPED_BELOW else _DAMPED_BELOW**2 - s[-1] ** 2
    rates: FloatArray = vt.T @ (s / (s * s + damping2) * (u.T @ twist_base))
    return rates


def pose_vector(T_base_tool: FloatArray) -> tuple[float, ...]:
    """(x, y, z, rx, ry, rz) as the controller reports it: the rotation vector's length ≤ π."""
    return (*T_base_tool[:3, 3].tolist(), *_rotation_vector(T_base_tool[:3, :3].tolist()))


def _rotation_vector(R: list[list[float]]) -> tuple[float, float, float]:
    """By the quaternion, from its largest component; a tenth of the cost of SciPy's."""
    four_squares = (
        1.0 + R[0][0] + R[1][1] + R[2][2],
        1.0 + R[0][0] - R[1][1] - R[2][2],
        1.0 - R[0][0] + R[1][1] - R[2][2],
        1.0 - R[0][0] - R[1][1] + R[2][2],
    )
    odd = (R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1])
    even = (R[0][1] + R[1][0], R[0][2] + R[2][0], R[1][2] + R[2][1])
    largest = four_squares.index(max(four_squares))
    w, x, y, z = (
        (four_squares[0], odd[0], odd[1], odd[2]),
        (odd[0], four_squares[1], even[0], even[1]),
        (odd[1], even[0], four_squares[2], even[2]),
        (odd[2], even[1], even[2], four_squares[3]),
    )[largest]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    length = math.sqrt(x * x + y * y + z * z)
    # The scale of (w, x, y, z) does not matter: only its direction is used.
    factor = 2.0 * math.atan2(length, w) / length if length > 1e-12 * w else 2.0 / w
    return x * factor, y * factor, z * factor


def transform(pose: tuple[float, ...]) -> FloatArray:
    """The (4, 4) transform of (x, y, z, rx, ry, rz)."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(pose[3:6]).as_matrix()
    T[:3, 3] = pose[:3]
    return T


def joints_for(
    T_base_tool: FloatArray, q_near: FloatArray, T_flange_tool: FloatArray
) -> FloatArray:
    """Joint positions (6,) close to ``q_near`` that reach a tool pose (4, 4).

    Raises ValueError when Newton's method does not get there in 100 steps.
    """
    q = np.array(q_near, dtype=float)
    for _ in range(100):
        T, J = pose_and_jacobian(q, T_flange_tool)
        turn = Rotation.from_matrix(T_base_tool[:3, :3] @ T[:3, :3].T).as_rotvec()
        error = np.concatenate([T_base_tool[:3, 3] - T[:3, 3], turn])
        if float(np.abs(error).max()) < 1e-10:
            return q
        step = joint_rates(J, error)
        q = q + step * min(1.0, 0.5 / max(float(np.abs(step).max()), 1e-12))
    raise ValueError("no joint positions found for this tool pose near the present ones")
