"""Which arm it is, and how its joints move the tool: the published DH parameters of each model."""

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drivers.interfaces import Joints

FloatArray = NDArray[np.float64]

NAMES = ("base", "shoulder", "elbow", "wrist 1", "wrist 2", "wrist 3")
_TWISTS_RAD = (pi / 2, 0.0, 0.0, pi / 2, -pi / 2, 0.0)  # α of every model
_RANGE_RAD = 2.0 * pi  # to both sides; an installation may allow less
# As the data sheets have them; the wrists of some models are faster.
_FASTEST_RAD_S = (pi,) * 6
_FASTEST_LARGE_RAD_S = (2 * pi / 3, 2 * pi / 3, 5 * pi / 6, pi, pi, pi)

# An arm's own calibration differs from the published values by a few millimetres.
_SAME_M = 0.015
_SAME_RAD = 0.05


@dataclass(frozen=True, slots=True)
class Model:
    """DH parameters as Universal Robots publishes them."""

    name: str
    a_m: tuple[float, float]  # of the upper arm and the forearm; zero elsewhere
    d_m: tuple[float, float, float, float]  # of joints 1, 4, 5 and 6; zero elsewhere
    fastest_rad_s: tuple[float, ...] = _FASTEST_RAD_S


MODELS = (
    Model("UR3", (-0.24365, -0.21325), (0.1519, 0.11235, 0.08535, 0.0819)),
    Model("UR5", (-0.425, -0.39225), (0.089159, 0.10915, 0.09465, 0.0823)),
    Model("UR10", (-0.612, -0.5723), (0.1273, 0.163941, 0.1157, 0.0922), _FASTEST_LARGE_RAD_S),
    Model("UR3e", (-0.24355, -0.2132), (0.15185, 0.13105, 0.08535, 0.0921)),
    Model("UR5e", (-0.425, -0.3922), (0.1625, 0.1333, 0.0997, 0.0996)),
    Model("UR10e", (-0.6127, -0.57155), (0.1807, 0.17415, 0.11985, 0.11655), _FASTEST_LARGE_RAD_S),
    Model("UR16e", (-0.4784, -0.36), (0.1807, 0.17415, 0.11985, 0.11655), _FASTEST_LARGE_RAD_S),
    Model("UR20", (-0.862, -0.7287), (0.2363, 0.201, 0.1593, 0.1543), _FASTEST_LARGE_RAD_S),
    Model("UR30", (-0.637, -0.5037), (0.2363, 0.201, 0.1593, 0.1543), _FASTEST_LARGE_RAD_S),
)

# What follows from a model that is none of these, in words.
UNGUARDED = "the UR model is not recognised: joint ends and singularities are not guarded"


class Kinematics:
    """One model with one TCP; joint positions are those the controller reports."""

    def __init__(self, model: Model, tcp_offset: FloatArray | tuple[float, ...]) -> None:
        self.model = model
        d = model.d_m
        self._d = (d[0], 0.0, 0.0, d[1], d[2], d[3])
        self._a = (0.0, *model.a_m, 0.0, 0.0, 0.0)
        self._T_flange_tool = np.eye(4)
        self._T_flange_tool[:3, 3] = tcp_offset[:3]
        self._T_flange_tool[:3, :3] = Rotation.from_rotvec(tcp_offset[3:]).as_matrix()

    def tool_pose(self, q: FloatArray) -> FloatArray:
        """T_base_tool (4, 4) at joint positions ``q`` (6,)."""
        return self._frames(q)[-1]

    def tool_jacobian(self, q: FloatArray) -> FloatArray:
        """J (6, 6): the tool's twist in its own axes is J q̇."""
        frames = self._frames(q)
        T = frames[-1]
        J = np.zeros((6, 6))
        for k in range(6):
            axis, lever = frames[k][:3, 2], T[:3, 3] - frames[k][:3, 3]
            J[:3, k] = T[:3, :3].T @ np.cross(axis, lever)
            J[3:, k] = T[:3, :3].T @ axis
        return J

    def joints(self, q: FloatArray) -> Joints:
        """The joints at ``q`` (6,)."""
        end = np.full(6, _RANGE_RAD)
        fastest = np.array(self.model.fastest_rad_s)
        return Joints(NAMES, q, -end, end, (False,) * 6, self.tool_jacobian, fastest)

    def _frames(self, q: FloatArray) -> list[FloatArray]:
        """The frames (4, 4) each joint turns in, and the tool's, in base."""
        T, out = np.eye(4), []
        for angle, a, d, twist in zip(q, self._a, self._d, _TWISTS_RAD, strict=True):
            out.append(T)
            c, s, ct, st = cos(angle), sin(angle), cos(twist), sin(twist)
            link = np.array(
                [
                    [c, -s * ct, s * st, a * c],
                    [s, c * ct, -c * st, a * s],
                    [0.0, st, ct, d],
                    [0.0, 0.0, 0.0, 1.0],
                ]
            )
            T = T @ link
        return [*out, T @ self._T_flange_tool]


def identify(
    q: FloatArray, T_base_tool: FloatArray, tcp_offset: FloatArray | tuple[float, ...]
) -> Kinematics | None:
    """The model whose tool would be where it is measured; None for an arm that is none of them.

    ``q`` (6,) and ``T_base_tool`` (4, 4) are of one sample. No two models agree in a pose that
    is within both tolerances of the measured one unless their links are alike.
    """
    best: tuple[float, Kinematics] | None = None
    for model in MODELS:
        kinematics = Kinematics(model, tcp_offset)
        T = kinematics.tool_pose(q)
        off_m = float(np.linalg.norm(T[:3, 3] - T_base_tool[:3, 3]))
        turn = Rotation.from_matrix(T[:3, :3].T @ T_base_tool[:3, :3]).magnitude()
        if off_m < _SAME_M and turn < _SAME_RAD and (best is None or off_m < best[0]):
            best = off_m, kinematics
    return None if best is None else best[1]
