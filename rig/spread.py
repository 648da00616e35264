"""How far off the radius of an estimator may be that does not say so itself."""


def left_m(chi: float, first_chi: float, left: float) -> float:
    """What may be left of the first guess's error when ``left`` of the transient is to come.

    The estimate has come 1 − ``left`` of the way from its guess.
    """
    # A run hardly begun: all that is known is that the guess may be off by as much again.
    left = min(left, 0.5)
    return abs(chi - first_chi) * left / (1.0 - left) / chi**2
