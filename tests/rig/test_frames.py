"""Twists of joined bodies agree with differentiating their poses."""

import numpy as np
from scipy.spatial.transform import Rotation

from rig.frames import invert, twist_map


def transform(rng: np.random.Generator) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    T[:3, 3] = rng.normal(size=3)
    return T


def moved(T_base_a: np.ndarray, twist_a: np.ndarray, dt: float) -> np.ndarray:
    """The pose after moving a with its own constant twist for a short time."""
    out = T_base_a.copy()
    out[:3, 3] += T_base_a[:3, :3] @ twist_a[:3] * dt
    out[:3, :3] = T_base_a[:3, :3] @ Rotation.from_rotvec(twist_a[3:] * dt).as_matrix()
    return out


def test_the_mapped_twist_moves_the_other_body_along() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        T_base_a, T_a_b, twist_b = transform(rng), transform(rng), rng.normal(size=6)
        dt = 1e-7
        moved_with_a = moved(T_base_a, twist_map(T_a_b) @ twist_b, dt) @ T_a_b
        moved_itself = moved(T_base_a @ T_a_b, twist_b, dt)
        assert np.allclose(moved_with_a, moved_itself, atol=1e-12)


def test_the_inverse_map_is_the_map_of_the_inverse() -> None:
    T = transform(np.random.default_rng(2))
    assert np.allclose(twist_map(T) @ twist_map(invert(T)), np.eye(6))
    assert np.allclose(invert(T) @ T, np.eye(4))
