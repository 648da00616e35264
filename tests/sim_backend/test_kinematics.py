"""The gantry's kinematics, held against MuJoCo's and against finite differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim_backend.clock import SimulatedClock
from sim_backend.config import ArmConfig
from sim_backend.kinematics import (
    JOINT_HIGH,
    JOINT_LOW,
    joint_rates,
    joints_for,
    tool_pose,
    tool_twist,
)
from sim_backend.mujoco_import import load_mujoco
from sim_backend.world import World, load_gantry

RANDOM = np.random.default_rng(5)
POSTURES = RANDOM.uniform(0.9 * JOINT_LOW, 0.9 * JOINT_HIGH, (20, 6))


@pytest.mark.parametrize("q", POSTURES[:5])
def test_the_pose_and_the_jacobian_are_those_of_the_mujoco_model(q):
    mujoco = load_mujoco()
    model, data = load_gantry(ArmConfig())
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    T = tool_pose(q)
    np.testing.assert_allclose(data.site_xpos[0], T[:3, 3], atol=1e-12)
    np.testing.assert_allclose(data.site_xmat[0].reshape(3, 3), T[:3, :3], atol=1e-12)
    J = np.zeros((6, 6))
    mujoco.mj_jacSite(model, data, J[:3], J[3:], 0)
    qd = RANDOM.normal(size=6)
    twist_base = J @ qd
    R = T[:3, :3].T
    expected = np.concatenate([R @ twist_base[:3], R @ twist_base[3:]])
    np.testing.assert_allclose(tool_twist(q, qd), expected, atol=1e-12)


def test_at_zero_the_tool_looks_straight_down():
    np.testing.assert_allclose(tool_pose(np.zeros(6))[:3, :3], np.diag([1.0, -1.0, -1.0]))


@pytest.mark.parametrize("q", POSTURES)
def test_joints_for_a_pose_reach_it(q):
    reached = joints_for(tool_pose(q))
    np.testing.assert_allclose(tool_pose(reached), tool_pose(q), atol=1e-12)


@pytest.mark.parametrize("q", POSTURES)
def test_joint_rates_give_the_twist_away_from_the_singularity(q):
    q = q.copy()
    q[4] = np.clip(q[4], -np.deg2rad(80), np.deg2rad(80))
    twist = RANDOM.normal(size=6)
    np.testing.assert_allclose(tool_twist(q, joint_rates(q, twist)), twist, atol=1e-9)


def test_at_the_singularity_joint_rates_stay_bounded_and_the_tool_still_moves_straight():
    q = np.array([0.0, 0.0, 0.0, 0.3, np.pi / 2, 0.2])
    twist = np.array([0.05, 0.0, 0.02, 0.1, 0.1, 0.1])
    qd = joint_rates(q, twist)
    assert np.max(np.abs(qd)) < 3.0
    np.testing.assert_allclose(tool_twist(q, qd)[:3], twist[:3], atol=1e-9)


@pytest.mark.parametrize("tilt_deg", [-80, 80])
@pytest.mark.parametrize("about", ["X", "Y"])
def test_tilts_of_80_degrees_about_both_horizontal_axes_lie_within_the_joints(about, tilt_deg):
    T = np.eye(4)
    tilt = Rotation.from_euler(about, tilt_deg, degrees=True)
    T[:3, :3] = tilt.as_matrix() @ np.diag([1.0, -1.0, -1.0])
    T[:3, 3] = [0.0, 0.0, 0.8]
    q = joints_for(T)
    assert np.all(q > JOINT_LOW)
    assert np.all(q < JOINT_HIGH)


def test_recorded_velocities_are_the_derivatives_of_recorded_positions():
    clock = SimulatedClock()
    world = World(ArmConfig(), np.zeros(6), clock)
    world.command(np.array([0.05, 0.03, -0.04, 0.2, -0.1, 0.3]), 1.0)
    clock.sleep_until(0.5)
    world.sync()
    for t in (0.0105, 0.05, 0.1234, 0.4):
        h = 1e-4
        difference = (world.history.at(t + h)[0] - world.history.at(t - h)[0]) / (2 * h)
        np.testing.assert_allclose(world.history.at(t)[1], difference, atol=2e-5)
