"""The joint model: arm pose, hand-eye, board and intrinsics together predict every corner.

T_camera_board = (T_base_tool T_tool_camera)⁻¹ T_base_board, where the arm's pose is itself
measured with an error. That error is not fitted but averaged over: it correlates the residuals
of one view, and the residuals are whitened accordingly, so that an exact arm counts for much
and a bad one for little.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.calibration import se3
from rig.calibration.projection import COUNT, project
from rig.calibration.views import Stack

FloatArray = NDArray[np.float64]

# Positions of the unknowns in a step: the camera in its own axes, the board in its own axes,
# the intrinsics, the board's scale.
CAMERA = slice(0, 6)
BOARD = slice(6, 12)
INTRINSICS = slice(12, 12 + COUNT)
SCALE = 12 + COUNT
UNKNOWNS = SCALE + 1


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of what was measured."""

    corner_px: float  # per coordinate
    arm_m: float  # per axis of the tool's position
    arm_rad: float  # per axis of the tool's orientation


@dataclass(frozen=True, slots=True)
class State:
    """The unknowns."""

    T_tool_camera: FloatArray  # (4, 4)
    T_base_board: FloatArray  # (4, 4)
    intrinsics: FloatArray  # (9,)
    scale: float = 1.0  # true size of the board over the claimed one

    def moved(self, step: FloatArray) -> "State":
        """The state after a step (22,)."""
        return State(
            self.T_tool_camera @ se3.exp(step[CAMERA]),
            self.T_base_board @ se3.exp(step[BOARD]),
            self.intrinsics + step[INTRINSICS],
            self.scale + float(step[SCALE]),
        )


@dataclass(frozen=True, slots=True)
class Linear:
    """Residuals and derivatives of every view at one state."""

    residuals: FloatArray  # (m, 2n) seen minus predicted, px; 0 where no corner was seen
    by_step: FloatArray  # (m, 2n, 22) of the prediction
    by_arm: FloatArray  # (m, 2n, 6) of the prediction, by a motion of the tool in its own axes
    T_camera_board: FloatArray  # (m, 4, 4)
    in_front: bool  # whether every corner has positive depth


def board_seen(state: State, T_base_tool: FloatArray) -> FloatArray:
    """T_camera_board (m, 4, 4) that the state predicts."""
    return se3.inverse(T_base_tool @ state.T_tool_camera) @ state.T_base_board


def linearise(state: State, T_base_tool: FloatArray, corners: Stack) -> Linear:
    """Residuals and their derivatives for arm poses (m, 4, 4)."""
    T = board_seen(state, T_base_tool)
    got = project(state.intrinsics, T, state.scale * corners.points_m)
    m, n = corners.seen.shape
    seen = corners.seen[..., None]
    J = (got.by_pose * seen[..., None]).reshape(m, 2 * n, 6)
    by_step = np.empty((m, 2 * n, UNKNOWNS))
    by_step[..., CAMERA] = -J
    by_step[..., BOARD] = J @ se3.adjoint(T)
    by_step[..., INTRINSICS] = (got.by_intrinsics * seen[..., None]).reshape(m, 2 * n, COUNT)
    by_step[..., SCALE] = (got.by_scale * seen / state.scale).reshape(m, 2 * n)
    return Linear(
        residuals=((corners.pixels - got.pixels) * seen).reshape(m, 2 * n),
        by_step=by_step,
        by_arm=-J @ se3.adjoint(se3.inverse(state.T_tool_camera)),
        T_camera_board=T,
        in_front=bool(np.all(got.depth_m > 0.0)),
    )


@dataclass(frozen=True, slots=True)
class Whitener:
    """Turns residuals into independent ones of unit variance, view by view."""

    basis: FloatArray  # (m, 2n, 6) orthonormal: where the arm's error shows
    shrink: FloatArray  # (m, 6) 1 − the factor applied along each of these
    corner_px: float

    def __call__(self, values: FloatArray) -> FloatArray:
        """Whiten (m, 2n) or (m, 2n, k)."""
        flat = values[..., None] if values.ndim == 2 else values
        along = np.swapaxes(self.basis, 1, 2) @ flat
        out = (flat - self.basis @ (self.shrink[..., None] * along)) / self.corner_px
        return out[..., 0] if values.ndim == 2 else out


def whitener(linear: Linear, noise: Noise) -> Whitener:
    """The symmetric root of the inverse of σ² 1 + G Σ Gᵀ, with G the derivative by the arm.

    Symmetric, so that one bad corner stays one large residual and a robust loss sees it.
    """
    spread = np.repeat([noise.arm_m, noise.arm_rad], 3) / noise.corner_px
    G = linear.by_arm * spread
    # By its small normal matrix: many times faster than the singular values of G itself.
    power, turn = np.linalg.eigh(np.swapaxes(G, 1, 2) @ G)
    power = np.maximum(power, 1e-12)
    basis = (G @ turn) / np.sqrt(power)[:, None, :]
    return Whitener(basis, 1.0 - 1.0 / np.sqrt(1.0 + power), noise.corner_px)
