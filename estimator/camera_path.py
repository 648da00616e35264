"""Where the camera is, as seen from where the first image was taken."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.displacement import displacement
from estimator.estimate import Estimate
from estimator.image.feature import Feature
from estimator.models.model import Model
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CameraPath:
    """The motion from the first image to ``t_s``: a fixed X is seen at R X − d; see there."""

    t_s: float
    R: FloatArray  # (3, 3)
    d: FloatArray  # (3,)

    def until(self, t_s: float, motion: TwistHistory) -> "CameraPath":
        """The path to a later instant; raises MotionUnknownError where it is not known."""
        window = motion.window(self.t_s, t_s)
        R, d = displacement(window.times_s, window.twists_camera)
        return CameraPath(t_s, R @ self.R, R @ self.d + d)


def path_from(t_s: float) -> CameraPath:
    """The path of a camera that has not moved yet."""
    return CameraPath(t_s, np.eye(3), np.zeros(3))


def oriented(
    model: Model, feature: Feature, last_axis: FloatArray | None
) -> tuple[FloatArray, FloatArray | None]:
    """s and the axis of a feature, the axis pointing the way of ``last_axis``."""
    near = None if last_axis is None else np.concatenate((np.zeros(3), last_axis))
    return model.position_and_axis(model.measured(feature, near))


def across(axis: FloatArray | None) -> FloatArray:
    """The projector (3, 3) onto where s may lie: I − a aᵀ, or I."""
    return np.eye(3) if axis is None else np.eye(3) - np.outer(axis, axis)


def carried(estimate: Estimate, now_s: float, motion: TwistHistory) -> Estimate:
    """The estimate moved on to ``now_s`` with its χ̂; how sure it is stays as it was.

    Raises ValueError for an earlier instant, MotionUnknownError where the motion is not known.
    """
    if not now_s >= estimate.t_s:
        raise ValueError(f"there is no image at or before {now_s:.6f} s to predict from")
    if now_s == estimate.t_s:
        return estimate
    window = motion.window(estimate.t_s, now_s)
    R, d = displacement(window.times_s, window.twists_camera)
    axis = None if estimate.axis is None else R @ estimate.axis
    return Estimate(
        t_s=now_s,
        s=across(axis) @ (R @ estimate.s - estimate.chi * d),
        axis=axis,
        chi=estimate.chi,
        variance=estimate.variance,
        residual=estimate.residual,
        extrapolated_s=window.extrapolated_s,
        doubt=estimate.doubt,
    )
