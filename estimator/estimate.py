"""What an estimator says: the target's state at an instant, and the interface it answers by."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.image.feature import Feature
from estimator.twist_history import TwistHistory

FloatArray = NDArray[np.float64]

# Of a normal distribution, 95 % lie within so many standard deviations.
DEVIATIONS_95 = 1.96


class Correction(Enum):
    """What became of an image handed to an estimator."""

    INITIALISED = "initialised"  # the first image: ŝ = s, χ̂ from the guess
    APPLIED = "applied"
    STALE = "stale"  # not later than the last image: ignored, the state is as it was
    RESTARTED = "restarted"  # what joins the images before to this one is lost: χ̂ kept, ŝ = s
    REJECTED = "rejected"  # contradicts the prediction: ignored, the state is as it was


@dataclass(frozen=True, slots=True)
class Estimate:
    """The target at one instant, in the camera frame of that instant."""

    t_s: float
    s: FloatArray  # (3,) P0 / R
    axis: FloatArray | None  # (3,) unit, cylinder only
    chi: float  # 1/R, in 1/m
    variance: float | None  # of chi; None when the estimator has no notion of it
    residual: float  # norm of what the last image contradicted the prediction by, unit of s
    extrapolated_s: float = 0.0  # how far the arm's motion was extrapolated to get here
    covariance: FloatArray | None = None  # (4, 4) of (s, chi), where it is known
    image_covariance: FloatArray | None = None  # (3, 3) of s as the last image showed it
    state: FloatArray | None = None  # (m,) the model's s, from estimators of any model
    unknowns: FloatArray | None = None  # (p,) all of the model's χ, the same
    doubt: str = ""  # why the images and the motion do not go together, if they do not

    @property
    def radius_m(self) -> float | None:
        """R = 1/χ̂, or None while χ̂ is not positive (an underdamped transient crosses zero)."""
        return 1.0 / self.chi if self.chi > 0.0 else None

    @property
    def radius_std_m(self) -> float | None:
        """Half the width of R's 68 % interval; None where it is unknown or has no upper end."""
        low_m, high_m = self.radius_interval_m(1.0)
        return None if high_m is None or low_m is None else 0.5 * (high_m - low_m)

    @property
    def interval_share(self) -> float:
        """How far the ends of R's 95 % interval are from R̂, as a share of it; inf: unknown."""
        low_m, high_m = self.radius_interval_m(DEVIATIONS_95)
        if self.chi <= 0.0 or low_m is None or high_m is None:
            return math.inf
        return max(high_m * self.chi - 1.0, 1.0 - low_m * self.chi)

    def radius_interval_m(self, deviations: float) -> tuple[float | None, float | None]:
        """R where χ̂ is taken so many standard deviations up and down: never negative.

        The upper end is None while χ may be zero, both while the variance is unknown.
        """
        if self.variance is None:
            return None, None
        half = deviations * math.sqrt(self.variance)
        low_m = 1.0 / (self.chi + half) if self.chi + half > 0.0 else None
        return low_m, 1.0 / (self.chi - half) if self.chi - half > 0.0 else None


class Estimator(Protocol):
    """Moves its state from image to image; anything later is only predicted."""

    def correct(self, feature: Feature, t_s: float, motion: TwistHistory) -> Correction:
        """Move the state to ``t_s``, the exposure instant of the image ``feature`` came from.

        Raises MotionUnknownError, with the state unchanged, when the arm's motion at ``t_s`` is
        not known yet.
        """
        ...

    @property
    def estimate(self) -> Estimate | None:
        """The state at the last image's exposure; None before the first image."""
        ...

    def predict(self, now_s: float, motion: TwistHistory) -> Estimate:
        """The target at ``now_s``, never earlier than the last image; the state stays as it is.

        Raises ValueError before the first image or for an earlier instant, and
        MotionUnknownError when the arm's motion is not known up to ``now_s``.
        """
        ...
