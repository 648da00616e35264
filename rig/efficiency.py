"""How good a run's estimate could have been at best."""

import numpy as np

from estimator.bound import cramer_rao
from estimator.kalman import TwistNoise
from estimator.twist_history import MotionUnknownError, TwistHistory
from rig.config import EstimatorConfig
from rig.frames import uncertainty_at_camera
from rig.run_data import RunData


def radius_bound_m(data: RunData, config: EstimatorConfig, radius_m: float) -> float | None:
    """The Cramér-Rao bound of R's standard deviation at the end, for a target of ``radius_m``.

    From the covariances that the images stated, so it is as honest as these. None for fewer
    than two images, or where the motion between them was lost.
    """
    arm = data.arm_track()
    if len(data.features) < 2 or len(arm.t_s) < 2:
        return None
    motion = TwistHistory(span_s=float(arm.t_s[-1] - arm.t_s[0]) + 1.0)
    motion.extend(arm.t_s, arm.twist_camera)
    motion.covariance, motion.density = uncertainty_at_camera(
        data.arm_states[-1], data.camera_from_tool
    )
    if motion.covariance is None:
        motion.covariance = TwistNoise(config.twist_std_m_s, config.twist_std_rad_s).covariance
    times_s = np.array([update.t_s for update in data.updates])
    try:
        chi_std = cramer_rao(times_s, data.features, 1.0 / radius_m, motion)[-1]
    except (MotionUnknownError, ArithmeticError):
        return None
    return float(chi_std) * radius_m**2
