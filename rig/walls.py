"""The workspace and the table as the camera sees them, for a policy that plans its way."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import ArmState
from rig.config_safety import SafetyConfig

FloatArray = NDArray[np.float64]


def walls_around(
    config: SafetyConfig, T_tool_camera: FloatArray, newest: Callable[[], ArmState | None]
) -> Callable[[], tuple[FloatArray, FloatArray] | None]:
    """A function that gives outward normals (k, 3) in camera axes and the room (k,) in m.

    None before the arm's first state. The camera is taken to move as the tool does.
    """
    outward = np.concatenate((np.eye(3), -np.eye(3)))
    limits_m = np.concatenate((config.workspace_max_m, -np.array(config.workspace_min_m)))
    table = config.table

    def walls() -> tuple[FloatArray, FloatArray] | None:
        state = newest()
        if state is None:
            return None
        T_base_camera = state.T_base_tool @ T_tool_camera
        normals, rooms_m = outward, limits_m - outward @ state.T_base_tool[:3, 3]
        if table is not None:
            normal = np.array(table.normal)
            points = (state.T_base_tool[:3, 3], T_base_camera[:3, 3])
            height_m = min(float(normal @ p) for p in points) - table.offset_m
            normals = np.concatenate((normals, -normal[None]))
            rooms_m = np.append(rooms_m, height_m - table.min_distance_m)
        return normals @ T_base_camera[:3, :3], rooms_m

    return walls
