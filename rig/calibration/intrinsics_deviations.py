"""How far the fitted intrinsics may be off, from the residuals that were measured."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.calibration.lens_model import LensModel
from rig.calibration.projection import COUNT, project
from rig.calibration.views import BoardView, stack

FloatArray = NDArray[np.float64]


def covariance_of(
    views: Sequence[BoardView], values: FloatArray, T_camera_board: FloatArray, model: LensModel
) -> tuple[FloatArray, float]:
    """Covariance (9, 9) of the intrinsics with all poses free, and the corners' rms distance in px.

    The larger, coefficient by coefficient, of two: the normal equations scaled by the measured
    residual, which is right when every corner errs by itself, and the scatter of the views'
    own pulls, which stays right when the corners of one view err together.
    """
    together = stack(views)
    seen = together.seen[..., None]
    got = project(values, T_camera_board, together.points_m)
    m, free = len(together), model.free
    r = ((together.pixels - got.pixels) * seen).reshape(m, -1)
    J = (got.by_pose * seen[..., None]).reshape(m, -1, 6)
    K = (got.by_intrinsics[..., free] * seen[..., None]).reshape(m, r.shape[1], -1)
    # Each view's own pose takes its share: what is left speaks about the intrinsics.
    K = K - J @ np.linalg.solve(np.swapaxes(J, 1, 2) @ J, np.swapaxes(J, 1, 2) @ K)
    normal = np.einsum("mni,mnj->ij", K, K)
    pulls = np.einsum("mni,mn->mi", K, r)
    fitted = int(free.sum())
    sigma2 = float(np.sum(r**2)) / max(2 * together.corners - 6 * m - fitted, 1)
    inverse = np.linalg.inv(normal)
    model_based = sigma2 * inverse
    scatter = inverse @ (pulls.T @ pulls) @ inverse * (m / max(m - 1, 1))
    ratio = np.sqrt(np.maximum(np.diag(scatter) / np.diag(model_based), 1.0))
    out = np.zeros((COUNT, COUNT))
    out[np.ix_(free, free)] = model_based * np.outer(ratio, ratio)
    return out, float(np.sqrt(np.sum(r**2) / together.corners))
