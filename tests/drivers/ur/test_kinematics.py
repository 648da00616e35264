"""The published kinematics: poses, Jacobians against differences, and telling the models apart."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drivers.ur.kinematics import MODELS, Kinematics, Model, identify

TCP = (0.01, -0.02, 0.15, 0.1, 0.2, -0.3)
ANGLES = st.lists(st.floats(-6.0, 6.0), min_size=6, max_size=6).map(np.array)
NONE = (0.0,) * 6


def test_the_ur5e_reaches_as_far_as_its_data_sheet_says() -> None:
    ur5e = Kinematics(next(m for m in MODELS if m.name == "UR5e"), NONE)
    # Stretched out along −x, the arm lies at the height of its shoulder.
    T = ur5e.tool_pose(np.zeros(6))
    assert T[:3, 3] == pytest.approx([-0.8172, -0.1333 - 0.0996, 0.1625 - 0.0997], abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(ANGLES, ANGLES)
def test_the_jacobian_is_the_derivative_of_the_pose(q: np.ndarray, qd: np.ndarray) -> None:
    for model in MODELS:
        kinematics, h = Kinematics(model, TCP), 1e-6
        before, after = kinematics.tool_pose(q - h * qd), kinematics.tool_pose(q + h * qd)
        R = kinematics.tool_pose(q)[:3, :3]
        v = R.T @ (after[:3, 3] - before[:3, 3]) / (2 * h)
        w = Rotation.from_matrix(before[:3, :3].T @ after[:3, :3]).as_rotvec() / (2 * h)
        twist = kinematics.tool_jacobian(q) @ qd
        assert twist == pytest.approx(np.concatenate([v, w]), abs=1e-5)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_a_model_is_told_by_where_its_tool_is(model: Model) -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        q = random.uniform(-3, 3, 6)
        T = Kinematics(model, TCP).tool_pose(q)
        T[:3, 3] += random.normal(0, 1e-3, 3)  # its own calibration
        found = identify(q, T, TCP)
        assert found is not None
        assert found.model is model


def test_an_unknown_arm_is_not_guessed() -> None:
    q = np.array([0.1, -1.2, 1.4, -1.6, -1.5, 0.2])
    other = Kinematics(Model("none", (-0.5, -0.3), (0.2, 0.15, 0.1, 0.1)), NONE)
    assert identify(q, other.tool_pose(q), NONE) is None
