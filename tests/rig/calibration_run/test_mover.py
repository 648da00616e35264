"""The mover: gets to poses on the simulated arm, refuses what is blocked, always ends at rest."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.errors import SafetyError
from rig.calibration import se3
from rig.calibration_run.errors import PoseRefusedError, StopRequestedError
from rig.calibration_run.mover import Mover
from rig.config_safety import SafetyConfig
from sim_backend.arm import SimulatedArm
from sim_backend.clock import SimulatedClock
from sim_backend.config import ArmConfig
from sim_backend.world import World

SAFETY = SafetyConfig()
HOME = np.array([0.0, 0.0, -0.2, 0.1, -0.2, 0.3])


class Rig:
    """The simulated arm with nothing around it."""

    def __init__(self, safety: SafetyConfig = SAFETY) -> None:
        self.clock = SimulatedClock()
        self.arm = SimulatedArm(ArmConfig(), World(ArmConfig(), HOME, self.clock), seed=1)
        self.stop = False
        self.mover = Mover(self.arm, self.clock, safety, 0.05, lambda: self.stop)

    def at_rest(self) -> bool:
        self.clock.sleep_until(self.clock.now_s() + 0.5)
        return bool(np.abs(self.arm.read_states()[-1].twist_tool).max() < 5e-3)


def moved(T: np.ndarray, xyz_m: list[float], rotvec_rad: list[float]) -> np.ndarray:
    goal = T.copy()
    goal[:3, 3] += xyz_m
    goal[:3, :3] = goal[:3, :3] @ Rotation.from_rotvec(rotvec_rad).as_matrix()
    return goal


@pytest.mark.parametrize(
    ("xyz_m", "rotvec_rad"),
    [
        ([0.1, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([-0.05, 0.08, 0.03], [0.3, -0.2, 0.5]),
        ([0.0, 0.0, 0.0], [0.0, 0.4, -1.0]),
    ],
)
def test_it_comes_to_rest_at_the_pose(xyz_m: list[float], rotvec_rad: list[float]) -> None:
    rig = Rig()
    goal = moved(rig.mover.T_base_tool, xyz_m, rotvec_rad)
    rig.mover.go_to(goal)
    left = se3.log(se3.inverse(rig.mover.T_base_tool) @ goal)
    assert np.linalg.norm(left[:3]) < 2e-3
    assert np.linalg.norm(left[3:]) < 4e-3
    assert rig.at_rest()


def test_the_way_stays_within_the_envelope_s_speed() -> None:
    rig = Rig()
    rig.mover.go_to(moved(rig.mover.T_base_tool, [0.2, 0.0, 0.0], [0.0, 0.0, 1.5]))
    speeds = np.array([np.linalg.norm(s.twist_tool[:3]) for s in rig.mover.states])
    turns = np.array([np.linalg.norm(s.twist_tool[3:]) for s in rig.mover.states])
    assert speeds.max() < SAFETY.max_linear_speed_m_s
    assert turns.max() < SAFETY.max_angular_speed_rad_s


def test_a_pose_behind_a_wall_is_refused_with_the_wall_s_name() -> None:
    rig = Rig(SafetyConfig(workspace_max_m=(0.05, 2.0, 2.0)))
    with pytest.raises(PoseRefusedError, match="workspace x max"):
        rig.mover.go_to(moved(rig.mover.T_base_tool, [0.3, 0.0, 0.0], [0.0, 0.0, 0.0]))
    assert rig.at_rest()
    assert rig.mover.T_base_tool[0, 3] < 0.0502


def test_after_a_refusal_the_next_pose_is_reached() -> None:
    rig = Rig(SafetyConfig(workspace_max_m=(0.05, 2.0, 2.0)))
    start = rig.mover.T_base_tool
    with pytest.raises(PoseRefusedError):
        rig.mover.go_to(moved(start, [0.3, 0.0, 0.0], [0.0, 0.0, 0.0]))
    rig.mover.go_to(start)
    assert np.allclose(rig.mover.T_base_tool[:3, 3], start[:3, 3], atol=2e-3)


def test_a_motion_is_followed_and_ends_at_rest() -> None:
    rig = Rig()
    begin_s = rig.clock.now_s()
    rig.mover.follow(lambda t, T: 0.05 * np.sin(2 * np.pi * t) * np.eye(6)[0], 2.0)
    speeds = [s.twist_tool[0] for s in rig.mover.states if s.t_s > begin_s]
    assert max(speeds) == pytest.approx(0.05, rel=0.1)
    assert min(speeds) == pytest.approx(-0.05, rel=0.1)
    assert rig.at_rest()


def test_a_stop_request_ends_the_motion() -> None:
    rig = Rig()
    rig.mover.on_tick = lambda now_s: setattr(rig, "stop", now_s > 0.5)
    with pytest.raises(StopRequestedError):
        rig.mover.go_to(moved(rig.mover.T_base_tool, [0.3, 0.0, 0.0], [0.0, 0.0, 0.0]))
    assert rig.at_rest()


def test_an_arm_outside_its_workspace_is_not_moved() -> None:
    rig = Rig(SafetyConfig(workspace_max_m=(-0.5, 2.0, 2.0)))
    with pytest.raises(SafetyError, match="outside the workspace"):
        rig.mover.go_to(moved(rig.mover.T_base_tool, [0.01, 0.0, 0.0], [0.0, 0.0, 0.0]))
