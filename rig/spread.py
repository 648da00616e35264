"""How far off a radius may be: as the estimator states it, or judged from its transient."""

import numpy as np

from estimator.estimate import Estimate


def stated_m(estimate: Estimate) -> float | None:
    """One standard deviation of the radius, from that of χ; None where none is stated."""
    if estimate.variance is None or estimate.radius_m is None:
        return None
    return float(np.sqrt(estimate.variance)) * estimate.radius_m**2  # dR = R² dχ


def left_m(chi: float, first_chi: float, left: float) -> float:
    """What may be left of the first guess's error when ``left`` of the transient is to come.

    The estimate has come 1 − ``left`` of the way from its guess.
    """
    # A run hardly begun: all that is known is that the guess may be off by as much again.
    left = min(left, 0.5)
    return abs(chi - first_chi) * left / (1.0 - left) / chi**2
