"""The gantry's kinematics: three slides carrying up to three rotations in one point.

Joint vectors hold one entry per configured axis, in the configured order, in m and rad.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drivers.grbl.settings import AxisSettings, WristSettings

FloatArray = NDArray[np.float64]

# Below this smallest singular value of the wrist's axes the inverse is damped, so that joint
# speeds stay bounded through the singularity.
_DAMPED_BELOW = 0.1
_MAX_DAMPING = 0.05
_WRIST = ("roll", "pitch", "spin")
_MM_PER_M = 1000.0
_DEG_PER_RAD = float(np.rad2deg(1.0))


class GantryKinematics:
    """Forward and inverse kinematics, and the controller's units."""

    def __init__(self, axes: tuple[AxisSettings, ...], wrist: WristSettings) -> None:
        joints = [axis.joint for axis in axes]
        self.names = tuple(joints)
        self._slides = [joints.index(name) for name in ("x", "y", "z")]
        present = [name for name in _WRIST if name in joints]
        self._turns = [joints.index(name) for name in present]
        self._axes = [_unit(getattr(wrist, f"{name}_axis")) for name in present]
        self._skews = [_skew(axis) for axis in self._axes]
        self._centre = np.array(wrist.centre_xyz_m, dtype=float)
        self._tool_xyz = np.array(wrist.tool_xyz_m, dtype=float)
        self._R_tool = Rotation.from_rotvec(wrist.tool_rotvec_rad).as_matrix()
        self._per_si = np.array(
            [axis.sign * (_MM_PER_M if axis.is_slide else _DEG_PER_RAD) for axis in axes]
        )
        self._zero = np.array([axis.mpos_at_zero for axis in axes])

    @property
    def rotations(self) -> int:
        """How many wrist axes there are."""
        return len(self._turns)

    def joints(self, mpos: FloatArray) -> FloatArray:
        """Joint positions (n,) at machine coordinates (n,)."""
        q: FloatArray = (mpos - self._zero) / self._per_si
        return q

    def joint_rates_of(self, mpos_rates: FloatArray) -> FloatArray:
        """Joint velocities (n,) of axis velocities (n,) in units per second."""
        qd: FloatArray = mpos_rates / self._per_si
        return qd

    def axis_rates_of(self, qd: FloatArray) -> FloatArray:
        """Axis velocities (n,) in units per second of joint velocities (n,)."""
        rates: FloatArray = qd * self._per_si
        return rates

    def tool_pose(self, q: FloatArray) -> FloatArray:
        """T_base_tool (4, 4) at joint positions ``q`` (n,)."""
        R_wrist, _ = self._wrist(q)
        T = np.eye(4)
        T[:3, :3] = R_wrist @ self._R_tool
        T[:3, 3] = self._centre + q[self._slides] + R_wrist @ self._tool_xyz
        return T

    def tool_twist(self, q: FloatArray, qd: FloatArray) -> FloatArray:
        """The tool's twist (6,) in its own axes at joint velocities ``qd`` (n,)."""
        R_wrist, axes = self._wrist(q)
        w = axes @ qd[self._turns]
        v = qd[self._slides] + _skew(w) @ (R_wrist @ self._tool_xyz)
        R = R_wrist @ self._R_tool
        return np.concatenate([R.T @ v, R.T @ w])

    def tool_jacobian(self, q: FloatArray) -> FloatArray:
        """J (6, n) with tool_twist(q, qd) = J @ qd."""
        R_wrist, axes = self._wrist(q)
        R_tool_base = (R_wrist @ self._R_tool).T
        arm = R_wrist @ self._tool_xyz
        J = np.zeros((6, len(q)))
        J[:3, self._slides] = R_tool_base
        J[:3, self._turns] = R_tool_base @ (-_skew(arm) @ axes)
        J[3:, self._turns] = R_tool_base @ axes
        return J

    def joint_rates(self, q: FloatArray, twist_tool: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint velocities (n,) for ``twist_tool`` (6,), and the rotation (3,) they leave out.

        The tool's origin always moves as asked. Near the wrist's singularity, and where axes
        are missing, the rotation is approximated in the (damped) least-squares sense; what is
        left out, in base axes and rad/s, includes what the damping costs.
        """
        R_wrist, axes = self._wrist(q)
        R = R_wrist @ self._R_tool
        v, w = R @ twist_tool[:3], R @ twist_tool[3:]
        turns = _damped_solve(axes, w)
        made = axes @ turns
        qd = np.zeros(len(self.names))
        qd[self._turns] = turns
        qd[self._slides] = v - _skew(made) @ (R_wrist @ self._tool_xyz)
        return qd, w - made

    def _wrist(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The last link's orientation (3, 3), and the wrist's axes (3, m) in base."""
        R = np.eye(3)
        axes = np.zeros((3, len(self._turns)))
        for k, index in enumerate(self._turns):
            axes[:, k] = R @ self._axes[k]
            # Rodrigues' formula: a hundredth of what a Rotation object costs, 200 times a second.
            K, angle = self._skews[k], q[index]
            R = R + R @ (np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K))
        return R, axes


def _damped_solve(axes: FloatArray, w: FloatArray) -> FloatArray:
    if axes.shape[1] == 0:
        return np.zeros(0)
    smallest = float(np.linalg.svd(axes, compute_uv=False)[-1])
    damping2 = 0.0
    if smallest < _DAMPED_BELOW:
        damping2 = _MAX_DAMPING**2 * (1.0 - (smallest / _DAMPED_BELOW) ** 2)
    normal = axes.T @ axes + damping2 * np.eye(axes.shape[1])
    turns: FloatArray = np.asarray(np.linalg.solve(normal, axes.T @ w), dtype=np.float64)
    return turns


def _skew(w: FloatArray) -> FloatArray:
    """The matrix (3, 3) of the cross product with ``w``."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def _unit(axis: tuple[float, float, float]) -> FloatArray:
    given = np.array(axis, dtype=float)
    unit: FloatArray = given / float(np.linalg.norm(given))
    return unit
