"""A kinematic camera that moves past points: exact images, an ideal arm, the loop closed."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.active.controller import Controller
from estimator.estimate import Estimate, Estimator
from estimator.twist_history import TwistHistory
from tests.estimator.exact_points import seen_points

FloatArray = NDArray[np.float64]

TICK_S = 0.02
TICKS_PER_IMAGE = 2


def drive(
    points_m: FloatArray, estimator: Estimator, controller: Controller, duration_s: float
) -> tuple[FloatArray, Estimate, FloatArray]:
    """Where the points (n, 3) end up in the camera's frame, what is known of them, and ‖v‖ (k,)."""
    R, position = np.eye(3), np.zeros(3)
    history, twist = TwistHistory(span_s=2.0), np.zeros(6)
    speeds: list[float] = []
    for tick in range(round(duration_s / TICK_S) + 1):
        t_s = tick * TICK_S
        # Constant from tick to tick: a new twist begins right after the instant it is given at.
        history.append(t_s, twist)
        P = (points_m - position) @ R
        if tick % TICKS_PER_IMAGE == 0:
            estimator.correct(seen_points(P), t_s, history)
        twist = controller.twist(estimator.predict(t_s, history), TICK_S)
        speeds.append(float(np.linalg.norm(twist[:3])))
        history.append(t_s + 1e-6, twist)
        half = Rotation.from_rotvec(0.5 * TICK_S * twist[3:]).as_matrix()
        position = position + R @ half @ (TICK_S * twist[:3])
        R = R @ half @ half
    estimate = estimator.estimate
    assert estimate is not None
    return P, estimate, np.array(speeds)
