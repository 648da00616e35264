"""The arm's kinematics; ``test_arm_model`` holds pose and Jacobian against MuJoCo's."""

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from sim_backend.loopback_ur.kinematics import (
    HOME_Q,
    joint_rates,
    joints_for,
    pose_and_jacobian,
    pose_vector,
    tool_pose,
    transform,
)

T_FLANGE_TOOL = transform((0.02, -0.03, 0.12, 0.3, -0.2, 0.1))


def test_at_home_the_tool_points_down():
    T = tool_pose(HOME_Q, np.eye(4))
    assert np.allclose(T[:3, 2], [0.0, 0.0, -1.0], atol=1e-12)
    assert T[2, 3] > 0.2


def test_joint_rates_give_the_twist_that_was_asked_for():
    twist = np.array([0.1, -0.05, 0.02, 0.2, 0.0, -0.3])
    J = pose_and_jacobian(HOME_Q, T_FLANGE_TOOL)[1]
    assert np.allclose(J @ joint_rates(J, twist), twist, atol=1e-12)


def test_joint_rates_stay_bounded_in_the_wrist_singularity():
    q = HOME_Q.copy()
    q[4] = 0.0
    J = pose_and_jacobian(q, np.eye(4))[1]
    assert np.abs(joint_rates(J, np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]))).max() < 40.0


def test_joints_for_inverts_the_pose():
    rng = np.random.default_rng(7)
    q = HOME_Q + rng.uniform(-0.3, 0.3, 6)
    found = joints_for(tool_pose(q, T_FLANGE_TOOL), HOME_Q, T_FLANGE_TOOL)
    assert np.allclose(tool_pose(found, T_FLANGE_TOOL), tool_pose(q, T_FLANGE_TOOL), atol=1e-9)
    far = np.eye(4)
    far[:3, 3] = [5.0, 0.0, 0.0]
    with pytest.raises(ValueError, match="no joint positions"):
        joints_for(far, HOME_Q, T_FLANGE_TOOL)


def test_pose_vectors_and_transforms_are_inverse():
    T = tool_pose(HOME_Q + 0.1, T_FLANGE_TOOL)
    assert np.allclose(transform(pose_vector(T)), T, atol=1e-12)


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(0.0, np.pi))
@example((1.0, 0.0, 0.0), np.pi)
@example((0.0, 1.0, 0.0), np.pi)
@example((0.3, -0.5, 0.8), np.pi)
@example((0.0, 0.0, 1.0), 1e-9)
def test_rotation_vectors_are_exact_for_every_angle(axis, angle):
    assume(np.linalg.norm(axis) > 0.1)
    T = transform((0.0, 0.0, 0.0, *(angle * np.array(axis) / np.linalg.norm(axis))))
    vector = pose_vector(T)
    assert np.linalg.norm(vector[3:]) <= np.pi + 1e-9
    assert np.allclose(transform(vector), T, atol=1e-9)
