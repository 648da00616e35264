"""Which directions leave room between what limits the camera's position."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Unit normals (k, 3) in the camera's axes and how far (k,) the camera may go along each, in m.
Walls = tuple[FloatArray, FloatArray]

# Room kept beyond the way for braking, as a share of it.
BRAKING_SHARE = 0.5


def room_for(directions: FloatArray, way_m: float, walls: Walls | None) -> BoolArray:
    """Which of the unit directions (n, 3) can be gone for ``way_m`` and braked in."""
    if walls is None:
        return np.ones(len(directions), dtype=bool)
    normals, rooms_m = walls
    closing_m = (1.0 + BRAKING_SHARE) * way_m * directions @ normals.T
    return np.asarray(((closing_m <= rooms_m) | (closing_m <= 0.0)).all(axis=1))
