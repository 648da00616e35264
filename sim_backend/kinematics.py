"""The gantry's kinematics: X, Y, Z slides, then a wrist about x, y and the tool's own axis.

Joint vectors are (x, y, z, roll, pitch, spin) in metres and radians. At zero the tool looks
straight down (z of the tool = −z of base, x = x), so the wrist's singularity, pitch = ±90°,
lies in the horizontal and both tilts reach ±80°. The rotations meet in one point, the wrist
centre; the tool frame sits ``TOOL_OFFSET_M`` further along the tool's z axis.
"""

import numpy as np
from numpy.typing import NDArray

from sim_backend.jit import jit

FloatArray = NDArray[np.float64]

TOOL_OFFSET_M = 0.05
WRIST_HOME_HEIGHT_M = 0.9  # of the wrist centre above the floor at joint zero
JOINT_LOW = np.array([-0.8, -0.8, -0.75, -1.75, -1.52, -2 * np.pi])
JOINT_HIGH = np.array([0.8, 0.8, 0.8, 1.75, 1.52, 2 * np.pi])

# Below this smallest singular value of the wrist's axes (reached at 81.9° of pitch) the
# inverse is damped, so that joint speeds stay bounded through the singularity.
_DAMPED_BELOW = 0.1
_MAX_DAMPING = 0.05


@jit
def wrist_axes(q: FloatArray) -> FloatArray:
    """The (3, 3) directions in base of the wrist's three rotations, as columns."""
    sr, cr, sp, cp = np.sin(q[3]), np.cos(q[3]), np.sin(q[4]), np.cos(q[4])
    axes = np.zeros((3, 3))
    axes[0, 0] = 1.0
    axes[1, 1], axes[2, 1] = cr, sr
    axes[0, 2], axes[1, 2], axes[2, 2] = sp, -sr * cp, cr * cp
    return axes


@jit
def tool_pose(q: FloatArray) -> FloatArray:
    """T_base_tool (4, 4) at joint positions ``q`` (6,)."""
    axes = wrist_axes(q)
    ss, cs = np.sin(q[5]), np.cos(q[5])
    T = np.eye(4)
    # The third axis is the direction that the spin leaves alone: −z of the tool. The other
    # two columns of roll·pitch turn by the spin; diag(1, −1, −1) makes the tool look down.
    for i in range(3):
        up = axes[i, 2]
        along = axes[(i + 1) % 3, 1] * axes[(i + 2) % 3, 2]
        along -= axes[(i + 2) % 3, 1] * axes[(i + 1) % 3, 2]
        across = axes[i, 1]
        T[i, 0] = cs * along + ss * across
        T[i, 1] = ss * along - cs * across
        T[i, 2] = -up
        T[i, 3] = q[i] - TOOL_OFFSET_M * up
    T[2, 3] += WRIST_HOME_HEIGHT_M
    return T


@jit
def tool_twist(q: FloatArray, qd: FloatArray) -> FloatArray:
    """The tool's twist (6,) in its own axes at joint velocities ``qd`` (6,)."""
    T = tool_pose(q)
    axes = wrist_axes(q)
    w = axes @ qd[3:]
    v = qd[:3] - TOOL_OFFSET_M * _cross(w, axes[:, 2])
    twist = np.zeros(6)
    for i in range(3):
        twist[i] = T[0, i] * v[0] + T[1, i] * v[1] + T[2, i] * v[2]
        twist[3 + i] = T[0, i] * w[0] + T[1, i] * w[1] + T[2, i] * w[2]
    return twist


@jit
def tool_jacobian(q: FloatArray) -> FloatArray:
    """J (6, 6) with tool_twist(q, qd) = J @ qd."""
    J = np.zeros((6, 6))
    qd = np.zeros(6)
    for i in range(6):
        qd[i] = 1.0
        J[:, i] = tool_twist(q, qd)
        qd[i] = 0.0
    return J


@jit
def joint_rates(q: FloatArray, twist_tool: FloatArray) -> FloatArray:
    """Joint velocities (6,) that give the tool ``twist_tool`` (6,) in its own axes.

    Near the wrist's singularity the rotation is approximated in the damped least-squares
    sense; the tool's origin still moves as asked.
    """
    T = tool_pose(q)
    axes = wrist_axes(q)
    v, w = np.zeros(3), np.zeros(3)
    for i in range(3):
        v[i] = T[i, 0] * twist_tool[0] + T[i, 1] * twist_tool[1] + T[i, 2] * twist_tool[2]
        w[i] = T[i, 0] * twist_tool[3] + T[i, 1] * twist_tool[4] + T[i, 2] * twist_tool[5]
    smallest = np.sqrt(max(1.0 - abs(np.sin(q[4])), 0.0))
    damping2 = 0.0
    if smallest < _DAMPED_BELOW:
        damping2 = _MAX_DAMPING**2 * (1.0 - (smallest / _DAMPED_BELOW) ** 2)
    normal = axes.T @ axes
    for i in range(3):
        normal[i, i] += damping2
    qd = np.zeros(6)
    qd[3:] = np.linalg.solve(normal, axes.T @ w)
    qd[:3] = v + TOOL_OFFSET_M * _cross(axes @ qd[3:], axes[:, 2])
    return qd


@jit
def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    c = np.zeros(3)
    c[0] = a[1] * b[2] - a[2] * b[1]
    c[1] = a[2] * b[0] - a[0] * b[2]
    c[2] = a[0] * b[1] - a[1] * b[0]
    return c


def joints_for(T_base_tool: FloatArray) -> FloatArray:
    """Joint positions (6,) at which the tool has pose ``T_base_tool`` (4, 4), |pitch| ≤ 90°."""
    down = -T_base_tool[:3, 2]
    q = np.zeros(6)
    q[:3] = T_base_tool[:3, 3] + TOOL_OFFSET_M * down
    q[2] -= WRIST_HOME_HEIGHT_M
    q[3] = np.arctan2(-down[1], down[2])
    q[4] = np.arctan2(down[0], np.hypot(down[1], down[2]))
    unspun = tool_pose(q)[:3, :3].T @ T_base_tool[:3, :3]
    # The tool's z points down: turning the wrist by +spin turns the tool by −spin about it.
    q[5] = -np.arctan2(unspun[1, 0], unspun[0, 0])
    return q
