"""The limiter: nothing leaves the envelope, every cut has a reason, breaches stop the run."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.errors import SafetyError
from drivers.interfaces import ArmState, Joints
from rig.config_safety import SafetyConfig
from rig.envelope import Surroundings
from rig.safety import Limiter

DT_S = 0.01
CONFIG = SafetyConfig()


def state_at(
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.5),
    twist: np.ndarray | None = None,
    t_s: float = 0.0,
) -> ArmState:
    T_base_tool = np.eye(4)
    T_base_tool[:3, 3] = position_m
    return ArmState(t_s, T_base_tool, np.zeros(6) if twist is None else twist)


def settled(twist: np.ndarray, state: ArmState | None = None) -> np.ndarray:
    """What the limiter lets through once its ramp is over."""
    limiter, state = Limiter(CONFIG), state or state_at()
    for _ in range(500):
        allowed = limiter.limit(twist, Surroundings(state), DT_S)
    return allowed.twist_tool


def test_a_motion_inside_the_envelope_passes_unchanged_after_its_ramp() -> None:
    twist = np.array([0.05, 0.0, 0.02, 0.1, -0.2, 0.0])
    assert np.allclose(settled(twist), twist)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-20, 20), min_size=6, max_size=6))
def test_speed_never_exceeds_its_limits_and_the_path_keeps_its_shape(twist: list[float]) -> None:
    allowed = settled(np.array(twist))
    assert np.linalg.norm(allowed[:3]) <= CONFIG.max_linear_speed_m_s * (1 + 1e-9)
    assert np.linalg.norm(allowed[3:]) <= CONFIG.max_angular_speed_rad_s * (1 + 1e-9)
    scale = np.linalg.norm(twist)
    if scale > 1e-3:
        assert np.allclose(allowed / np.linalg.norm(allowed), np.array(twist) / scale, atol=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.lists(st.floats(-1, 1), min_size=6, max_size=6), min_size=2, max_size=20))
def test_acceleration_never_exceeds_its_limits(twists: list[list[float]]) -> None:
    limiter, last = Limiter(CONFIG), np.zeros(6)
    for twist in twists:
        allowed = limiter.limit(np.array(twist), Surroundings(state_at()), DT_S).twist_tool
        step = (allowed - last) / DT_S
        assert np.linalg.norm(step[:3]) <= CONFIG.max_linear_acceleration_m_s2 * (1 + 1e-9)
        assert np.linalg.norm(step[3:]) <= CONFIG.max_angular_acceleration_rad_s2 * (1 + 1e-9)
        last = allowed


def test_the_ramp_starts_from_the_measured_motion() -> None:
    moving = np.array([0.1, 0, 0, 0, 0, 0])
    allowed = Limiter(CONFIG).limit(np.zeros(6), Surroundings(state_at(twist=moving)), DT_S)
    assert allowed.twist_tool[0] == pytest.approx(0.1 - CONFIG.max_linear_acceleration_m_s2 * DT_S)
    assert allowed.reasons == ("linear acceleration",)


def test_a_start_from_rest_keeps_the_direction_of_the_whole_twist() -> None:
    twist, limiter = np.array([0.1, -0.05, 0.02, 0.4, 0.1, -0.3]), Limiter(CONFIG)
    for _ in range(5):
        allowed = limiter.limit(twist, Surroundings(state_at()), DT_S).twist_tool
        assert np.allclose(allowed / np.linalg.norm(allowed), twist / np.linalg.norm(twist))


def test_after_a_restart_the_ramp_begins_at_the_measured_motion() -> None:
    limiter = Limiter(CONFIG)
    for _ in range(50):
        limiter.limit(np.array([0.1, 0, 0, 0, 0, 0]), Surroundings(state_at()), DT_S)
    limiter.restart()  # the arm stood still meanwhile
    allowed = limiter.limit(np.array([0.1, 0, 0, 0, 0, 0]), Surroundings(state_at()), DT_S)
    assert allowed.twist_tool[0] == pytest.approx(CONFIG.max_linear_acceleration_m_s2 * DT_S)


def test_motion_towards_a_wall_stops_there_and_motion_away_passes() -> None:
    at_wall = state_at((CONFIG.workspace_max_m[0], 0.0, 0.5))
    assert not np.any(settled(np.array([0.05, 0.03, 0, 0, 0, 0]), at_wall))
    assert settled(np.array([-0.05, 0.03, 0, 0, 0, 0]), at_wall)[:2] == pytest.approx([-0.05, 0.03])


def test_walls_are_in_the_base_frame_whatever_way_the_tool_points() -> None:
    T_base_tool = np.eye(4)
    T_base_tool[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # tool x is base y
    T_base_tool[:3, 3] = (0.0, CONFIG.workspace_max_m[1], 0.5)
    state = ArmState(0.0, T_base_tool, np.zeros(6))
    assert not np.any(settled(np.array([0.05, 0.02, 0, 0, 0, 0]), state))
    assert settled(np.array([0.0, 0.02, 0, 0, 0, 0]), state)[:2] == pytest.approx([0.0, 0.02])


def test_driving_at_a_wall_never_passes_it() -> None:
    limiter, x = Limiter(CONFIG), CONFIG.workspace_max_m[0] - 0.05
    for _ in range(600):
        allowed = limiter.limit(
            np.array([0.15, 0, 0, 0, 0, 0]), Surroundings(state_at((x, 0, 0.5))), DT_S
        )
        x += allowed.twist_tool[0] * DT_S
    assert CONFIG.workspace_max_m[0] - 2e-3 < x <= CONFIG.workspace_max_m[0]
    assert allowed.blocked == "workspace x max"


def test_a_command_that_is_no_number_is_a_safety_stop() -> None:
    with pytest.raises(SafetyError, match="not a number"):
        Limiter(CONFIG).limit(np.array([np.nan, 0, 0, 0, 0, 0]), Surroundings(state_at()), DT_S)


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (state_at(t_s=-1.0), "1.000 s old"),
        (state_at(twist=np.array([1.0, 0, 0, 0, 0, 0])), "does not follow"),
        (state_at((9.0, 0, 0.5)), "outside the workspace"),
    ],
)
def test_a_breach_in_the_measured_state_is_a_safety_stop(state: ArmState, words: str) -> None:
    with pytest.raises(SafetyError, match=words):
        Limiter(CONFIG).check_state(state, now_s=0.0)


def test_a_sound_state_passes() -> None:
    Limiter(CONFIG).check_state(state_at(), now_s=0.01)


def test_an_axis_resting_on_its_end_does_not_keep_the_others_from_moving() -> None:
    def jacobian(_: np.ndarray) -> np.ndarray:
        # Rounding couples the axes: moving along z asks y for a hair.
        return np.eye(6) + 1e-18 * np.eye(6, k=1)

    names = ("x", "y", "z", "roll", "pitch", "spin")
    at_its_end = np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.0])
    joints = Joints(
        names, at_its_end, np.full(6, -0.5), np.full(6, 0.5), (True,) * 3 + (False,) * 3, jacobian
    )
    limiter, twist = Limiter(CONFIG), np.array([0.0, 1e-25, 0.005, 0.0, 0.0, 0.0])
    for _ in range(100):
        allowed = limiter.limit(twist, Surroundings(state_at(), joints=joints), DT_S)
    assert np.allclose(allowed.twist_tool, twist)
    outwards = limiter.limit(
        np.array([0.0, 0.01, 0, 0, 0, 0]), Surroundings(state_at(), joints=joints), DT_S
    )
    assert outwards.blocked == "joint y max"
