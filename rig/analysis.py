"""What a finished run shows: error against the ideal response, accuracy, motion, geometry."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.ideal import ideal_response, rms_vs_ideal, time_to_within
from rig.config import RigConfig
from rig.efficiency import radius_bound_m
from rig.paper_observer import observer_chi
from rig.run_data import ArmTrack, RunData, UpdateTrack

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Analysis:
    """One run's series and figures; those that need the true radius are None without it."""

    t_s: FloatArray  # (k,) since the first image used
    chi: FloatArray  # (k,)
    radius_m: FloatArray  # (k,)
    motion_t_s: FloatArray  # (n,) since the first image used
    sigma2: FloatArray  # (n,) of the measured motion, (m/s)²
    speed2: FloatArray  # (n,) ‖v‖² of the camera, (m/s)²
    path_m: FloatArray  # (n, 3) camera in the base frame
    optical_axes: FloatArray  # (n, 3) in the base frame
    target_m: FloatArray | None  # (3,) P0 in the base frame, as estimated at the end
    target_axis: FloatArray | None  # (3,) in the base frame, cylinder only
    radius_true_m: float | None
    z: FloatArray | None  # (k,) 1/R - chi, 1/m
    z_observer: FloatArray | None  # (k,) of the paper's observer; z itself where that one ran
    z_ideal: FloatArray | None  # (k,) what (5) promises of z_observer
    rms_vs_ideal: float | None  # of z_observer, as a share of |z(0)|
    time_to_1pct_s: float | None  # also None when it was never reached for good
    relative_error: float | None
    chi_std: FloatArray | None  # (k,) as stated, 1/m
    nees: float | None  # (z / chi_std)² at the end
    radius_bound_m: float | None  # the least standard deviation of R at the end

    @property
    def other_than_observer(self) -> bool:
        """Whether z_observer is there beside the estimator that the run was made with."""
        return self.z_observer is not None and self.z_observer is not self.z

    @property
    def deviation(self) -> FloatArray | None:
        """(k,) of the observer from the ideal response, as a share of |z(0)|."""
        if self.z_observer is None or self.z_ideal is None or self.z_observer[0] == 0.0:
            return None
        return (self.z_observer - self.z_ideal) / abs(float(self.z_observer[0]))


def analyse(data: RunData, config: RigConfig, radius_true_m: float | None) -> Analysis:
    """The series and figures of one run; ``radius_true_m`` serves the error figures only."""
    updates, arm = data.update_track(), data.arm_track()
    start_s = float(updates.t_s[0]) if len(updates.t_s) else 0.0
    end_s = float(updates.t_s[-1]) if len(updates.t_s) else 0.0
    during = (arm.t_s >= start_s) & (arm.t_s <= end_s)
    sigma2 = _sigma2(arm, updates)
    t_s = updates.t_s - start_s
    motion_t_s = arm.t_s - start_s
    z = z_observer = z_ideal = rms = to_1pct = relative = None
    with np.errstate(divide="ignore"):
        radius_m = 1.0 / updates.chi
    if radius_true_m is not None and len(t_s) > 1:
        z = 1.0 / radius_true_m - updates.chi
        z_observer = z
        if config.estimator.chosen != "observer":  # no other promises (5)
            chi = observer_chi(data, config.estimator)
            z_observer = None if chi is None else 1.0 / radius_true_m - chi
        gains = config.estimator.gains(data.target)
        if z_observer is not None:
            z_ideal = _ideal(motion_t_s, sigma2, gains, float(z_observer[0]), t_s)
            if z_observer[0] != 0.0:  # a perfect guess leaves no transient to compare
                rms = rms_vs_ideal(t_s, z_observer, z_ideal)
        relative_errors = radius_m / radius_true_m - 1.0
        to_1pct = time_to_within(t_s, relative_errors, 0.01)
        relative = float(relative_errors[-1])
    target_m, target_axis = _target_base(arm, updates, radius_m)
    return Analysis(
        t_s=t_s,
        chi=updates.chi,
        radius_m=radius_m,
        motion_t_s=motion_t_s[during],
        sigma2=sigma2[during],
        speed2=np.sum(arm.twist_camera[during, :3] ** 2, axis=1),
        path_m=arm.T_base_camera[during, :3, 3],
        optical_axes=arm.T_base_camera[during, :3, 2],
        target_m=target_m,
        target_axis=target_axis,
        radius_true_m=radius_true_m,
        z=z,
        z_observer=z_observer,
        z_ideal=z_ideal,
        rms_vs_ideal=rms,
        time_to_1pct_s=to_1pct,
        relative_error=relative,
        chi_std=None if updates.variance is None else np.sqrt(updates.variance),
        nees=_nees(z, updates),
        radius_bound_m=_bound_m(data, config, radius_true_m),
    )


def _bound_m(data: RunData, config: RigConfig, radius_true_m: float | None) -> float | None:
    """At the true radius, or else at the estimated one."""
    radius_m = radius_true_m
    if radius_m is None and data.updates:
        radius_m = data.updates[-1].radius_m
    return None if radius_m is None else radius_bound_m(data, config.estimator, radius_m)


def _nees(z: FloatArray | None, updates: UpdateTrack) -> float | None:
    """The normalised error squared at the end: 1 on average where the stated variance is true."""
    if z is None or updates.variance is None:
        return None
    return float(z[-1] ** 2 / updates.variance[-1])


def _ideal(
    motion_t_s: FloatArray,
    sigma2: FloatArray,
    gains: tuple[float, float],
    z0: float,
    at_s: FloatArray,
) -> FloatArray:
    """The response (5) to the measured motion, starting with z0 at the first image (t = 0)."""
    inside = (motion_t_s > 0.0) & (motion_t_s < at_s[-1])
    ends = np.interp([0.0, at_s[-1]], motion_t_s, sigma2)
    times = np.concatenate(([0.0], motion_t_s[inside], at_s[-1:]))
    squares = np.concatenate((ends[:1], sigma2[inside], ends[1:]))
    return ideal_response(times, squares, *gains, z0, at_s)


def _sigma2(arm: ArmTrack, updates: UpdateTrack) -> FloatArray:
    """σ1² at the arm's stamps: ‖v‖² (sphere), less (aᵀv)² with the measured axis (eq. 21)."""
    v = arm.twist_camera[:, :3]
    speed2: FloatArray = np.sum(v**2, axis=1)
    if updates.axis is None:
        return speed2
    axis = np.column_stack([np.interp(arm.t_s, updates.t_s, updates.axis[:, i]) for i in range(3)])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    sigma2: FloatArray = np.maximum(speed2 - np.sum(axis * v, axis=1) ** 2, 0.0)
    return sigma2


def _target_base(
    arm: ArmTrack, updates: UpdateTrack, radius_m: FloatArray
) -> tuple[FloatArray | None, FloatArray | None]:
    """P0 = s R̂ and the axis of the last image, carried into base by the nearest measured pose."""
    if len(updates.t_s) == 0 or len(arm.t_s) == 0 or not np.isfinite(radius_m[-1]):
        return None, None
    nearest = int(np.argmin(np.abs(arm.t_s - updates.t_s[-1])))
    R, p = arm.T_base_camera[nearest, :3, :3], arm.T_base_camera[nearest, :3, 3]
    P0 = R @ (updates.s[-1] * radius_m[-1]) + p
    return P0, None if updates.axis is None else R @ updates.axis[-1]
