"""The mover: gets to poses on the simulated arm, refuses what is blocked, always ends at rest."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.errors import MotionRefusedError, SafetyError
from rig.calibration import se3
from rig.calibration.excitation import Excitation
from rig.calibration_run.errors import PoseRefusedError, StopRequestedError
from rig.calibration_run.mover import Mover
from rig.calibration_run.recording import follower
from rig.config_safety import SafetyConfig, TableConfig
from sim_backend.arm import SimulatedArm
from sim_backend.clock import SimulatedClock
from sim_backend.config import ArmConfig
from sim_backend.world import World

SAFETY = SafetyConfig()
HOME = np.array([0.0, 0.0, -0.2, 0.1, -0.2, 0.3])


class Rig:
    """The simulated arm with nothing around it."""

    def __init__(self, safety: SafetyConfig = SAFETY) -> None:
        self.clock, self.safety = SimulatedClock(), safety
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


class Guard:
    """Notes what a deadman would be told."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def feed(self) -> None:
        self.told.append("feed")

    def rest(self) -> None:
        self.told.append("rest")


def test_the_deadman_is_fed_while_it_moves_and_relieved_at_rest() -> None:
    rig, guard = Rig(), Guard()
    rig.mover = Mover(
        rig.arm,
        rig.clock,
        SAFETY,
        0.05,
        lambda: False,
        deadman=guard,  # type: ignore[arg-type]
    )
    rig.mover.go_to(moved(rig.mover.T_base_tool, [0.05, 0.0, 0.0], [0.0, 0.0, 0.0]))
    assert guard.told.count("feed") > 50
    assert "rest" not in guard.told[:-1]
    assert guard.told[-1] == "rest"


def test_a_motion_that_the_arm_refuses_is_a_pose_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig()
    goal = moved(rig.mover.T_base_tool, [0.1, 0.0, 0.0], [0.0, 0.0, 0.0])
    command = rig.arm.command_twist

    def refuse(twist_tool: np.ndarray, hold_s: float) -> None:
        if np.any(twist_tool[:3]) and rig.clock.now_s() > 0.5:
            raise MotionRefusedError("axis X is at its end")
        command(twist_tool, hold_s)

    monkeypatch.setattr(rig.arm, "command_twist", refuse)
    with pytest.raises(PoseRefusedError, match="axis X is at its end"):
        rig.mover.go_to(goal)
    assert rig.at_rest()


def test_whatever_goes_wrong_in_a_motion_the_arm_is_told_to_stop() -> None:
    rig = Rig()

    def fail(now_s: float) -> None:
        if now_s > 0.5:
            raise KeyError("a bug")

    rig.mover.on_tick = fail
    with pytest.raises(KeyError):
        rig.mover.go_to(moved(rig.mover.T_base_tool, [0.3, 0.0, 0.0], [0.0, 0.0, 0.0]))
    assert rig.at_rest()


def test_the_camera_is_kept_off_the_table_too() -> None:
    camera = np.eye(4)
    camera[2, 3] = 0.06
    rig = Rig(SafetyConfig(table=TableConfig(offset_m=0.3, min_distance_m=0.05)))
    low = rig.mover.T_base_tool.copy()
    low[2, 3] = 0.38  # the tool clears the table, a camera in front of it does not
    assert rig.mover.reach().blocked_by(low) == ""
    rig.mover = Mover(rig.arm, rig.clock, rig.safety, 0.05, lambda: False, T_tool_camera=camera)
    assert rig.mover.reach().blocked_by(low) == "table (camera)"


def test_a_motion_with_late_commands_is_drawn_back_to_where_it_should_be() -> None:
    rig = Rig()
    motion, start = Excitation(3.0, seed=3), rig.mover.T_base_tool

    def late(now_s: float) -> None:
        # Ticks that are missed: the arm runs out of commands again and again.
        if int(10 * now_s) % 4 == 0:
            rig.clock.sleep_until(now_s + 0.25)

    rig.mover.on_tick = late
    rig.mover.follow(follower(start, np.eye(4), motion), motion.duration_s + 2.0)
    back = se3.log(se3.inverse(start) @ rig.mover.T_base_tool)
    assert np.linalg.norm(back[:3]) < 8e-3
    assert np.linalg.norm(back[3:]) < 0.03
