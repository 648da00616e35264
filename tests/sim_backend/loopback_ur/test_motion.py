"""The emulated arm's dynamics, cycle by cycle."""

import numpy as np
import pytest

from sim_backend.loopback_ur.kinematics import HOME_Q, tool_pose
from sim_backend.loopback_ur.motion import STEP_S, Motion, MotionConfig

TWIST = np.array([0.05, -0.02, 0.01, 0.0, 0.0, 0.2])


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
    motion = at_home(lag_s=1e-4)
    motion.speed_tool(np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0]), 1.0)
    speeds = np.linalg.norm(run(motion, 0.2)[:, :3], axis=1)
    assert np.diff(speeds).max() < 1.02 * 1.0 * STEP_S
    assert speeds[-1] == pytest.approx(0.2, rel=0.02)


def test_stopl_stops_in_v_over_a_and_stands_exactly():
    motion = at_home(lag_s=1e-4)
    motion.speed_tool(TWIST * 4, 5.0)
    run(motion, 1.0)
    motion.stop_tool(2.0)
    speed = np.linalg.norm(TWIST[:3]) * 4
    twists = np.abs(run(motion, 1.0)).max(axis=1)
    moving = np.flatnonzero(twists > 1e-6)
    # The angular part, 0.8 rad/s at 2 rad/s², takes longest.
    assert moving[-1] * STEP_S == pytest.approx(max(speed, 0.8) / 2.0, abs=0.02)
    assert motion.at_rest


def test_positions_integrate_velocities():
    motion = at_home()
    motion.speed_tool(np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0]), 2.0)
    before = tool_pose(motion.q, np.eye(4))[0, 3]
    twists = run(motion, 1.0)
    moved = tool_pose(motion.q, np.eye(4))[0, 3] - before
    assert moved == pytest.approx(twists[:, 0].sum() * STEP_S, rel=2e-3)


def test_more_than_a_joint_can_do_is_flagged_and_cut():
    motion = at_home()
    motion.speed_tool(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 20.0]), 150.0)
    flagged = False
    for _ in range(200):
        motion.step()
        flagged = flagged or motion.overspeed
        assert np.abs(motion.qd_target).max() <= np.pi + 1e-9
    assert flagged


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
