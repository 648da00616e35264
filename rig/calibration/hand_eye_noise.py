"""How exact the corners and the arm's poses were, from the residuals of a fit.

Within a view the corners can err in 2n ways, and only six of them look like the arm standing
elsewhere. The others measure the corners' noise; what the six have above it is the arm's.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from rig.calibration.hand_eye_model import INTRINSICS, Linear, Noise, State

FloatArray = NDArray[np.float64]

_LEAST = (2e-6, 2e-6)  # m, rad: no arm is believed to be better
_MOST = (0.05, 0.2)
_LEAST_PX = 0.005


def measured_noise(linear: Linear, state: State, free: NDArray[np.bool_], corners: int) -> Noise:
    """The noise that explains the residuals of a fit with the ``free`` (22,) unknowns best.

    Restricted maximum likelihood: the share of the residuals that the fit itself swallowed is
    accounted for, which matters with ten views.
    """
    J = linear.by_arm
    normal = np.swapaxes(J, 1, 2) @ J
    inverse = np.asarray(np.linalg.inv(normal), dtype=float)  # (m, 6, 6)
    project = inverse @ np.swapaxes(J, 1, 2)
    moved = (project @ linear.residuals[..., None])[..., 0]  # (m, 6) of the tool, in its axes
    off = linear.residuals - (J @ moved[..., None])[..., 0]
    design = project @ linear.by_step[..., free]  # (m, 6, p)
    rest = linear.by_step[..., free] - J @ design
    within = np.einsum("mni,mnj->ij", rest, rest)
    only_intrinsics = int(np.sum(free[INTRINSICS]))
    spare = max(2 * corners - 6 * len(J) - only_intrinsics, 1)
    sigma_px = max(_robust_rms(off, spare), _LEAST_PX)
    arm = _likeliest(moved, design, sigma_px**2 * inverse, within / sigma_px**2)
    return Noise(sigma_px, float(arm[0]), float(arm[1]))


def arm_deviations(linear: Linear) -> FloatArray:
    """By which twist (m, 6) of the tool, in its axes, each view disagrees with the fit."""
    J = linear.by_arm
    normal = np.swapaxes(J, 1, 2) @ J
    right = np.swapaxes(J, 1, 2) @ linear.residuals[..., None]
    return np.asarray(np.linalg.solve(normal, right)[..., 0], dtype=float)


def _robust_rms(off: FloatArray, spare: int) -> float:
    """The rms with the largest residuals cut at four sigmas."""
    values = off[off != 0.0]
    sigma = 1.4826 * float(np.median(np.abs(values)))
    cut = np.clip(values, -4.0 * sigma, 4.0 * sigma)
    return float(np.sqrt(np.sum(cut**2) / spare))


def _likeliest(
    moved: FloatArray, design: FloatArray, corner_part: FloatArray, within: FloatArray
) -> FloatArray:
    """Standard deviations (2,) of the arm's position and orientation."""

    def cost(logs: FloatArray) -> float:
        spread = np.repeat(np.exp(2.0 * logs), 3)
        V = corner_part + np.diag(spread)
        weighted = np.linalg.solve(V, np.concatenate([design, moved[..., None]], axis=2))
        normal = np.einsum("mki,mkj->ij", design, weighted[..., :-1]) + within
        right = np.einsum("mki,mk->i", design, weighted[..., -1])
        quadratic = np.einsum("mk,mk->", moved, weighted[..., -1])
        quadratic -= right @ np.linalg.solve(normal, right)
        return float(np.sum(np.linalg.slogdet(V)[1]) + np.linalg.slogdet(normal)[1] + quadratic)

    bounds = [(np.log(low), np.log(high)) for low, high in zip(_LEAST, _MOST, strict=True)]
    start = [
        np.clip(np.log(np.sqrt(np.mean(part**2)) + 1e-12), *bound)
        for part, bound in zip((moved[:, :3], moved[:, 3:]), bounds, strict=True)
    ]
    found = minimize(
        cost, np.array(start), method="Nelder-Mead", bounds=bounds, options={"xatol": 0.02}
    )
    return np.asarray(np.exp(found.x), dtype=float)
