"""The gantry's motion controller: from a tool twist to joint velocity references, every step."""

import numpy as np
from numpy.typing import NDArray

from sim_backend.jit import jit
from sim_backend.kinematics import JOINT_HIGH, JOINT_LOW, joint_rates

FloatArray = NDArray[np.float64]

# Approaching a joint limit the speed falls with the remaining distance over this time, several
# times the drives' lag, so that the joint creeps onto its limit instead of running through it.
_LIMIT_APPROACH_S = 0.1


@jit
def update_reference(
    reference: FloatArray,
    q: FloatArray,
    twist_tool: FloatArray,
    max_speed: FloatArray,
    max_acceleration: FloatArray,
    dt_s: float,
) -> None:
    """Move the joint velocity ``reference`` (6,), in place, one step towards ``twist_tool``.

    Speed and acceleration limits scale all joints by the same factor, which keeps the
    direction of the motion; a joint limit stops only the joint that reached it.
    """
    rates = joint_rates(q, twist_tool)
    excess = 1.0
    for i in range(6):
        excess = max(excess, abs(rates[i]) / max_speed[i])
    step_excess = 1.0
    for i in range(6):
        rates[i] /= excess
        change = abs(rates[i] - reference[i])
        step_excess = max(step_excess, change / (max_acceleration[i] * dt_s))
    for i in range(6):
        reference[i] += (rates[i] - reference[i]) / step_excess
        up = max(JOINT_HIGH[i] - q[i], 0.0)
        down = max(q[i] - JOINT_LOW[i], 0.0)
        # Slow enough to stop in time at the acceleration limit, and slower still at the end.
        most = min(np.sqrt(1.5 * max_acceleration[i] * up), up / _LIMIT_APPROACH_S)
        least = -min(np.sqrt(1.5 * max_acceleration[i] * down), down / _LIMIT_APPROACH_S)
        reference[i] = min(max(reference[i], least), most)
