"""Which poses are in reach, worked out from the Jacobian alone, against the gantry itself."""

import numpy as np
import pytest

from drivers.interfaces import ArmState, Joints
from rig.calibration import se3
from rig.calibration_run.reach import Reach
from rig.config_safety import SafetyConfig, TableConfig
from sim_backend.arm import joints_at
from sim_backend.kinematics import JOINT_HIGH, tool_jacobian, tool_pose

HOME = np.array([0.0, 0.0, -0.2, 0.1, -0.2, 0.3])
T_HOME = tool_pose(HOME)


def reach(joints: Joints | None, safety: SafetyConfig | None = None) -> Reach:
    return Reach(safety or SafetyConfig(), ArmState(0.0, T_HOME, np.zeros(6)), joints)


@pytest.mark.parametrize("seed", range(5))
def test_poses_well_inside_the_joints_ranges_are_in_reach(seed: int) -> None:
    rng = np.random.default_rng([seed, 5])
    q = HOME + rng.uniform(-1, 1, 6) * [0.3, 0.3, 0.2, 0.5, 0.5, 1.0]
    assert reach(joints_at(HOME)).blocked_by(tool_pose(q)) == ""


@pytest.mark.parametrize("joint", [0, 1, 3])
def test_a_pose_beyond_a_joint_s_end_names_the_joint(joint: int) -> None:
    q = HOME.copy()
    q[joint] = JOINT_HIGH[joint] + 0.05
    names = joints_at(HOME).names
    wide = SafetyConfig(workspace_min_m=(-5, -5, -5), workspace_max_m=(5, 5, 5))
    assert reach(joints_at(HOME), wide).blocked_by(tool_pose(q)) == f"joint {names[joint]} max"


def test_walls_and_table_count_without_joints_too() -> None:
    low = se3.pose(np.eye(3), np.array([0.0, 0.0, 0.12 - T_HOME[2, 3]])) @ T_HOME
    table = SafetyConfig(table=TableConfig(min_distance_m=0.15))
    assert reach(None).blocked_by(low) == ""
    assert reach(None, table).blocked_by(low) == "table (tool)"
    box = SafetyConfig(workspace_min_m=(-2, -2, 0.2))
    assert reach(None, box).blocked_by(low) == "workspace z min"


def test_an_arm_that_only_translates_cannot_turn() -> None:
    whole = joints_at(HOME)
    slides = Joints(
        whole.names[:3], HOME[:3], whole.low[:3], whole.high[:3], (True,) * 3,
        lambda q: tool_jacobian(np.append(q, HOME[3:]))[:, :3],
    )  # fmt: skip
    aside = T_HOME.copy()
    aside[0, 3] += 0.1
    assert reach(slides).blocked_by(aside) == ""
    turned = T_HOME @ se3.exp(np.array([0, 0, 0, 0.2, 0, 0]))
    assert "no joints for this motion" in reach(slides).blocked_by(turned)
