"""The emulated arm's dynamics, step by step."""

import numpy as np
import pytest

from sim_backend.loopback_ur import arm_model
from sim_backend.loopback_ur.kinematics import HOME_Q, tool_pose, transform
from sim_backend.loopback_ur.motion import STEP_S, Motion, MotionConfig

TWIST = np.array([0.05, -0.02, 0.01, 0.0, 0.0, 0.2])


LAG_S = MotionConfig().lag_s


def at_home(**changes):
    return Motion(MotionConfig(**changes), HOME_Q, np.eye(4))


def run(motion, seconds):
    """Twists in base axes after each cycle."""
    out = []
    for _ in range(round(seconds / STEP_S)):
        motion.step()
        out.append(motion.twist_base())
    return np.array(out)


def test_at_rest_it_stays_exactly_where_it_is():
    motion = at_home()
    run(motion, 0.2)
    assert np.array_equal(motion.q, HOME_Q)


def test_speedl_reaches_and_holds_the_tool_twist():
    motion = at_home()
    motion.speed_tool(TWIST, 2.0)
    twists = run(motion, 0.6)
    assert np.allclose(twists[-50:], TWIST, atol=2e-4)


def test_the_first_cycle_moves_already():
    motion = at_home()
    motion.speed_tool(TWIST, 2.0)
    motion.step()
    assert 0.0 < np.linalg.norm(motion.twist_base()[:3]) <= 2.0 * STEP_S


def test_acceleration_is_limited_along_the_way():
    motion = at_home()
    motion.speed_tool(np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0]), 1.0)
    speeds = np.linalg.norm(run(motion, 0.2)[:, :3], axis=1)
    assert np.diff(speeds).max() < 1.02 * 1.0 * STEP_S
    assert speeds[-1] == pytest.approx(0.2 - 1.0 * LAG_S, abs=2e-3)


def test_the_joints_lag_behind_their_references_and_do_not_overshoot():
    motion = at_home()
    motion.speed_tool(np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0]), 4.0)
    speeds = run(motion, 0.3)[:, 1]
    assert speeds.max() < 0.1 * 1.01
    asked = np.minimum(4.0 * STEP_S * np.arange(1, len(speeds) + 1), 0.1)
    late_m = float((asked - speeds).sum() * STEP_S)
    assert late_m == pytest.approx(0.1 * (LAG_S - STEP_S), rel=0.1)


def test_stopl_stops_in_v_over_a_and_stands_exactly():
    motion = at_home()
    motion.speed_tool(TWIST * 4, 5.0)
    run(motion, 1.0)
    motion.stop_tool(2.0)
    speed = np.linalg.norm(TWIST[:3]) * 4
    twists = np.abs(run(motion, 1.0)).max(axis=1)
    moving = np.flatnonzero(twists > 1e-3)
    # The angular part, 0.8 rad/s at 2 rad/s², takes longest.
    assert moving[-1] * STEP_S == pytest.approx(max(speed, 0.8) / 2.0 + 3.0 * LAG_S, abs=0.02)
    assert motion.at_rest
    before = motion.q
    run(motion, 0.1)
    assert np.array_equal(motion.q, before)


def test_positions_integrate_velocities():
    motion = at_home()
    motion.speed_tool(np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0]), 2.0)
    before = tool_pose(motion.q, np.eye(4))[0, 3]
    twists = run(motion, 1.0)
    moved = tool_pose(motion.q, np.eye(4))[0, 3] - before
    assert moved == pytest.approx(twists[:, 0].sum() * STEP_S, rel=2e-3)


def until_violated(motion, seconds):
    for _ in range(round(seconds / STEP_S)):
        motion.step()
        if motion.violation is not None:
            return motion.violation
    return None


def test_more_than_a_joint_can_do_is_a_violation_and_not_followed():
    motion = at_home()
    motion.speed_tool(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 20.0]), 150.0)
    assert "faster than it can" in until_violated(motion, 0.4)
    assert np.abs(motion.qd_target).max() <= np.pi


@pytest.mark.parametrize(
    ("joints", "twist"),
    [
        ({4: 0.0}, [0.0, 0.1, 0.0, 0.0, 0.0, 0.0]),  # wrist axes parallel
        ({2: 0.0}, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]),  # arm stretched out
    ],
)
def test_in_a_singularity_the_arm_stands_and_what_it_cannot_do_is_a_violation(joints, twist):
    q = HOME_Q.copy()
    for joint, value in joints.items():
        q[joint] = value
    motion = Motion(MotionConfig(), q, np.eye(4))
    motion.speed_tool(np.zeros(6), 2.0)
    assert until_violated(motion, 0.1) is None
    motion.speed_tool(np.array(twist), 2.0)
    assert "faster than it can" in until_violated(motion, 0.5)
    assert np.abs(motion.q - q).max() < 0.05


def test_driven_into_a_singularity_the_arm_is_stopped_before_it_is_there():
    motion = at_home()
    motion.speed_tool(np.array([0.25, 0.0, -0.1, 0.0, 0.0, 0.0]), 2.0)  # out, to its full reach
    assert "faster than it can" in until_violated(motion, 5.0)
    assert abs(motion.q[2]) > 1e-3  # the elbow is not yet straight


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_stops_inside_its_range_and_may_go_back(sign):
    q = HOME_Q.copy()
    q[5] = sign * 6.0
    motion = Motion(MotionConfig(), q, np.eye(4))
    motion.speed_joint(np.array([0.0, 0.0, 0.0, 0.0, 0.0, sign * 2.0]), 10.0)
    assert "joint 5 comes to the end of its range" in until_violated(motion, 2.0)
    motion.stop_joint(MotionConfig().protective_stop_rad_s2)
    run(motion, 0.3)
    assert 2.0 * np.pi - 0.05 < abs(motion.q[5]) <= 2.0 * np.pi
    motion.speed_joint(np.array([0.0, 0.0, 0.0, 0.0, 0.0, -sign * 0.5]), 10.0)
    assert until_violated(motion, 0.5) is None


def test_an_arm_that_its_motors_cannot_hold_is_a_violation(monkeypatch):
    monkeypatch.setattr(arm_model, "MAX_TORQUE_N_M", (150.0, 20.0, 150.0, 28.0, 28.0, 28.0))
    stretched = np.array([0.0, 0.0, 0.1, 0.0, np.pi / 2, 0.0])
    motion = Motion(MotionConfig(), stretched, np.eye(4))
    motion.speed_joint(np.array([0.0, -0.1, 0.0, 0.0, 0.0, 0.0]), 10.0)
    assert "does not follow its path" in until_violated(motion, 2.0)


def test_speedj_and_a_move_end_where_they_should():
    motion = at_home()
    motion.speed_joint(np.array([0.1, 0.0, 0.0, 0.0, 0.0, -0.2]), 2.0)
    run(motion, 0.5)
    assert np.allclose(motion.qd, [0.1, 0.0, 0.0, 0.0, 0.0, -0.2], atol=1e-6)
    motion.stop_joint(5.0)
    run(motion, 0.3)
    goal = HOME_Q + np.array([0.1, -0.2, 0.1, 0.0, 0.05, 0.0])
    motion.move(goal, 0.5, 2.0)
    run(motion, 1.5)
    assert motion.arrived
    assert np.allclose(motion.q, goal, atol=1e-6)


def test_the_speed_slider_scales_what_is_measured():
    motion = at_home()
    motion.speed_scaling = 0.5
    motion.speed_tool(TWIST, 2.0)
    assert np.allclose(run(motion, 0.6)[-1], 0.5 * TWIST, atol=2e-4)


def test_another_tool_changes_the_pose_and_not_the_joints():
    motion = at_home()
    q, before = motion.q, motion.actual()[0]
    T_flange_tool = transform((0.0, 0.0, 0.1, 0.0, 0.0, 0.5))
    motion.set_tool(T_flange_tool)
    run(motion, 0.02)
    assert np.array_equal(motion.q, q)
    assert np.allclose(motion.actual()[0], before @ T_flange_tool, atol=1e-12)
