"""Rotation vectors become matrices without a trace of their sign flip at π."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drivers.ur.geometry import pose_matrix, rotation_matrix, to_base_axes, to_tool_axes

components = st.floats(-7.0, 7.0)


@given(components, components, components)
def test_the_matrix_is_the_rotation(x, y, z):
    R = rotation_matrix(x, y, z)
    assert np.allclose(R, Rotation.from_rotvec([x, y, z]).as_matrix(), atol=1e-12)


@given(st.floats(0.0, 2 * np.pi))
def test_both_signs_at_pi_are_the_same_orientation(angle):
    r = np.pi * np.array([np.cos(angle), np.sin(angle), 0.0])
    assert np.allclose(rotation_matrix(*r), rotation_matrix(*-r), atol=1e-14)


def test_a_tool_pointing_down_that_wobbles_gives_no_jump():
    axis = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    below, above = (np.pi - 1e-4) * axis, -(np.pi - 1e-4) * axis  # as the controller reports it
    assert np.abs(rotation_matrix(*below) - rotation_matrix(*above)).max() < 3e-4


def test_a_pose_is_position_and_orientation():
    T = pose_matrix(np.array([0.1, 0.2, 0.3, 0.0, 0.0, np.pi / 2]))
    assert np.allclose(T[:3, 3], [0.1, 0.2, 0.3])
    assert np.allclose(T[:3, :3] @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    assert np.array_equal(T[3], [0.0, 0.0, 0.0, 1.0])


@given(components, components, components)
def test_twists_go_to_base_axes_and_back(x, y, z):
    R, twist = rotation_matrix(x, y, z), np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3])
    assert np.allclose(to_tool_axes(R, to_base_axes(R, twist)), twist)
    assert np.allclose(to_base_axes(R, twist)[:3], R @ twist[:3])
