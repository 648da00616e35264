"""The MuJoCo model of the arm against the published parameters it is made from."""

import numpy as np
import pytest

from sim_backend.loopback_ur.arm_model import MASS_KG, MAX_TORQUE_N_M, ArmModel, mjcf
from sim_backend.loopback_ur.kinematics import HOME_Q, pose_and_jacobian, transform
from sim_backend.mujoco_import import load_mujoco

STEP_S, LAG_S = 0.002, 0.006
T_FLANGE_TOOL = transform((0.02, -0.03, 0.12, 0.3, -0.2, 0.1))


def model():
    return load_mujoco().MjModel.from_xml_string(mjcf(LAG_S, STEP_S, T_FLANGE_TOOL))


@pytest.mark.parametrize("seed", range(5))
def test_pose_and_jacobian_follow_from_the_denavit_hartenberg_parameters(seed):
    arm = ArmModel(HOME_Q, T_FLANGE_TOOL, LAG_S, STEP_S)
    q = np.random.default_rng(seed).uniform(-np.pi, np.pi, 6)
    T, J = arm.pose_and_jacobian(q)
    T_expected, J_expected = pose_and_jacobian(q, T_FLANGE_TOOL)
    assert np.allclose(T, T_expected, atol=1e-12)
    assert np.allclose(J, J_expected, atol=1e-12)


def test_it_weighs_what_the_links_weigh():
    assert model().body_subtreemass[0] == pytest.approx(sum(MASS_KG))


def test_stretched_out_the_shoulder_carries_the_moment_of_the_published_masses():
    mujoco, arm = load_mujoco(), model()
    data = mujoco.MjData(arm)
    data.qpos[:] = 0.0  # horizontal, away from the base
    mujoco.mj_forward(arm, data)
    # By hand: each mass by its distance from the shoulder's axis, wrists at the forearm's end.
    arms_m = (0.425 - 0.2125, 0.425 + 0.3922 - 0.15, 0.8172, 0.8172, 0.8172)
    moment = 9.81 * sum(m * x for m, x in zip(MASS_KG[1:], arms_m, strict=True))
    assert abs(data.qfrc_bias[1]) == pytest.approx(moment, rel=0.02)
    assert moment < MAX_TORQUE_N_M[1]


@pytest.mark.parametrize("seed", range(4))
def test_the_servos_hold_the_arm_in_any_pose_against_gravity(seed):
    q = np.random.default_rng(seed).uniform(-np.pi, np.pi, 6)
    arm = ArmModel(q, T_FLANGE_TOOL, LAG_S, STEP_S)
    for _ in range(500):
        q_then, qd = arm.step(q)
    assert np.allclose(q_then, q, atol=1e-9)
    assert np.abs(qd).max() < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_at_constant_speed_the_joints_follow_a_lag_behind(seed):
    rng = np.random.default_rng(seed)
    q, rates = rng.uniform(-2.0, 2.0, 6), rng.uniform(-0.5, 0.5, 6)
    arm = ArmModel(q, T_FLANGE_TOOL, LAG_S, STEP_S)
    speed = np.zeros(6)
    for _ in range(400):
        speed += np.clip(rates - speed, -0.01, 0.01)
        q = q + speed * STEP_S
        q_then, qd = arm.step(q)
    assert np.allclose(qd, rates, atol=1e-4)
    # A step less than the lag, and half a step's difference between the two instants.
    assert np.allclose((q - q_then) / rates, LAG_S - 0.5 * STEP_S, atol=2e-4)


def test_the_torque_is_limited_gravity_included():
    mujoco, arm = load_mujoco(), model()
    data = mujoco.MjData(arm)
    data.ctrl[:] = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]  # a jump
    mujoco.mj_step(arm, data)
    assert np.all(np.abs(data.qfrc_actuator) <= np.array(MAX_TORQUE_N_M) + 1e-9)


def test_a_lag_shorter_than_a_step_is_refused():
    with pytest.raises(ValueError, match="shorter than the step"):
        ArmModel(HOME_Q, T_FLANGE_TOOL, 0.001, STEP_S)
