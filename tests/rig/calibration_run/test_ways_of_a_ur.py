"""The mover on a UR5e: no joint is asked for more than it can do, singularities are avoided."""

import numpy as np
import pytest

from rig.calibration import se3
from rig.calibration_run.errors import PoseRefusedError
from rig.calibration_run.mover import Mover
from rig.config_load import load_config, packaged_config
from sim_backend.clock import SimulatedClock
from sim_backend.loopback_ur.kinematics import tool_pose
from tests.rig.calibration_run.simulated_ur import SimulatedUr

SAFETY = load_config("sphere", packaged_config("loopback_ur5e.yaml")).safety
# Beside the base, the forearm folded onto the upper arm: slow tools take fast joints here.
FOLDED_Q = np.array([0.58, -0.49, -3.0, -0.64, 0.99, -1.65])
ASIDE_Q = np.array([1.02, 0.09, -2.77, -1.94, 0.72, -0.84])
BESIDE_Q = np.array([1.37, -0.85, -2.65, -1.78, 1.04, 0.91])
BEYOND_Q = np.array([-0.29, -1.46, -2.85, 0.35, 1.78, -1.53])
OPEN_Q = np.array([-0.36, -1.34, -1.84, -1.34, 1.78, -1.85])


class Rig:
    """A UR5e with nothing around it."""

    def __init__(self, q: np.ndarray) -> None:
        self.clock = SimulatedClock()
        self.arm = SimulatedUr(q, self.clock)
        self.mover = Mover(self.arm, self.clock, SAFETY, 0.05, lambda: False)


def pose(q: np.ndarray) -> np.ndarray:
    return tool_pose(q, np.eye(4))


def apart(T: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    way = se3.log(se3.inverse(T) @ other)
    return float(np.linalg.norm(way[:3])), float(np.linalg.norm(way[3:]))


def test_next_to_a_singularity_the_tool_is_slowed_so_that_no_joint_is_too_fast() -> None:
    rig = Rig(FOLDED_Q)
    rig.mover.go_to(pose(ASIDE_Q))
    assert apart(rig.mover.T_base_tool, pose(ASIDE_Q))[0] < 2e-3
    # Half of π is what the configuration allows; the controller stops at π.
    assert 1.4 < rig.arm.fastest_rad_s < 1.8


def test_a_way_through_a_singularity_is_led_around_it() -> None:
    rig = Rig(OPEN_Q)
    rig.mover.go_to(pose(BESIDE_Q))
    straight = rig.mover.reach().way(pose(BEYOND_Q))
    assert straight.blocked_by == "singularity"
    rig.mover.go_to(pose(BEYOND_Q))
    assert apart(rig.mover.T_base_tool, pose(BEYOND_Q))[0] < 2e-3
    assert rig.arm.fastest_rad_s < 1.8


def test_a_pose_beyond_reach_is_refused_before_anything_moves() -> None:
    rig = Rig(OPEN_Q)
    start, far = rig.mover.T_base_tool, pose(OPEN_Q).copy()
    far[:3, 3] += [0.9, 0.0, 0.0]
    with pytest.raises(PoseRefusedError, match="no way there is free: "):
        rig.mover.go_to(far)
    assert apart(rig.mover.T_base_tool, start) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_the_joints_foreseen_at_a_way_s_end_are_those_it_ends_with() -> None:
    rig = Rig(OPEN_Q)
    way = rig.mover.reach().way(pose(BESIDE_Q))
    before_s = rig.clock.now_s()
    rig.mover.go_to(pose(BESIDE_Q))
    assert way.joints is not None
    assert way.joints.q == pytest.approx(rig.arm.q, abs=0.01)
    assert way.duration_s < rig.clock.now_s() - before_s < 4.0 * way.duration_s + 1.0
