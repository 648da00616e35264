"""Workspace and table in the camera's axes: how far it may go, whatever way it looks."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.interfaces import ArmState
from rig.config_safety import SafetyConfig, TableConfig
from rig.walls import walls_around


def test_a_step_as_long_as_the_room_ends_at_the_wall() -> None:
    config = SafetyConfig(
        workspace_min_m=(-1.0, -2.0, 0.1),
        workspace_max_m=(1.0, 2.0, 3.0),
        table=TableConfig(offset_m=0.2, min_distance_m=0.05),
    )
    T_base_tool, T_tool_camera = np.eye(4), np.eye(4)
    T_base_tool[:3, :3] = Rotation.from_rotvec([1.0, -2.0, 0.5]).as_matrix()
    T_base_tool[:3, 3] = [0.3, 0.4, 1.0]
    T_tool_camera[:3, :3] = Rotation.from_rotvec([0.1, 0.2, -0.3]).as_matrix()
    T_tool_camera[:3, 3] = [0.0, 0.0, 0.1]
    state = ArmState(0.0, T_base_tool, np.zeros(6))
    found = walls_around(config, T_tool_camera, lambda: state)()
    assert found is not None
    normals, rooms_m = found
    camera_to_base = (T_base_tool @ T_tool_camera)[:3, :3]
    ends = T_base_tool[:3, 3] + rooms_m[:, None] * (normals @ camera_to_base.T)
    for k in range(3):
        assert ends[k, k] == pytest.approx(config.workspace_max_m[k])
        assert ends[3 + k, k] == pytest.approx(config.workspace_min_m[k])
    lowest_m = min(1.0, (T_base_tool @ T_tool_camera)[2, 3])
    assert rooms_m[6] == pytest.approx(lowest_m - 0.25)


def test_before_the_first_state_there_are_none_to_know() -> None:
    assert walls_around(SafetyConfig(), np.eye(4), lambda: None)() is None
