"""A rolling shutter exposes row after row: when a ball was seen depends on where it stands."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RollingShutter:
    """Instants of a ball's image; the skew within its outline is not undone."""

    row_time_s: float  # from a row to the one below
    intrinsics: Intrinsics

    def after_middle_s(self, s: FloatArray, height: int) -> float:
        """How long after the middle row of an image the row of a centre ``s`` (3,) was exposed."""
        row = float(self.intrinsics.project(s[None])[0, 1])
        return self.row_time_s * (row - (height - 1) / 2)
