"""The envelope: each barrier tells the truth about room and closing speed, and is never passed."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drivers.interfaces import ArmState, Joints
from estimator.estimate import Estimate
from estimator.image.intrinsics import Intrinsics
from rig.config_safety import SafetyConfig, TableConfig
from rig.envelope import Barrier, Envelope, Surroundings
from rig.field_of_view import border_planes, room_in_view
from rig.safety import Limiter
from sim_backend.kinematics import JOINT_HIGH, JOINT_LOW, tool_jacobian, tool_pose

DT_S = 0.01
RADIUS_M = 0.019
CAMERA = Intrinsics(800.0, 800.0, 319.5, 239.5)
SHAPE = (480, 640)
T_TOOL_CAMERA = np.eye(4)
T_TOOL_CAMERA[:3, :3] = Rotation.from_rotvec([0.1, -0.08, 0.12]).as_matrix()
T_TOOL_CAMERA[:3, 3] = [0.03, -0.02, 0.06]
CONFIG = SafetyConfig(table=TableConfig(offset_m=0.1, min_distance_m=0.05), reaction_time_s=0.02)
TWIST = st.lists(st.floats(-0.3, 0.3), min_size=6, max_size=6).map(np.array)


class World:
    """An exact arm with a camera over a sphere and a table, moved by its limiter's twists."""

    def __init__(self, q: np.ndarray, config: SafetyConfig = CONFIG) -> None:
        self.q = np.array(q, dtype=float)
        self.centre_m = self.camera()[:3, 3] + 0.3 * self.camera()[:3, 2]
        self.limiter = Limiter(config, Envelope(config, T_TOOL_CAMERA, CAMERA))
        self.envelope = Envelope(config, T_TOOL_CAMERA, CAMERA)
        self.target_seen = True

    def camera(self) -> np.ndarray:
        return tool_pose(self.q) @ T_TOOL_CAMERA

    def around(self) -> Surroundings:
        T = self.camera()
        s = T[:3, :3].T @ (self.centre_m - T[:3, 3]) / RADIUS_M
        names = ("x", "y", "z", "roll", "pitch", "spin")
        linear = (True, True, True, False, False, False)
        return Surroundings(
            state=ArmState(0.0, tool_pose(self.q), np.zeros(6)),
            target=Estimate(0.0, s, None, 1.0 / RADIUS_M, None, 0.0) if self.target_seen else None,
            joints=Joints(names, self.q, JOINT_LOW, JOINT_HIGH, linear, tool_jacobian),
            image_shape=SHAPE,
        )

    def move(self, twist_tool: np.ndarray, dt_s: float) -> None:
        self.q += dt_s * np.linalg.solve(tool_jacobian(self.q), twist_tool)

    def drive(self, twist_tool: np.ndarray, seconds: float) -> str:
        """Ask for one twist for a while; what blocked it at the end."""
        for _ in range(round(seconds / DT_S)):
            allowed = self.limiter.limit(twist_tool, self.around(), DT_S)
            self.move(allowed.twist_tool, DT_S)
        return allowed.blocked

    def barrier(self, name: str, twist_tool: np.ndarray) -> Barrier:
        found = (b for b in self.envelope.barriers(twist_tool, self.around()) if b.name == name)
        barrier = next(found)
        assert isinstance(barrier, Barrier)
        return barrier


HOME = np.array([0.1, -0.1, -0.2, 0.3, -0.2, 0.4])
# Close to every barrier, so that none is left out as out of reach.
NEAR_ALL = {"joint_margin_rad": 0.4, "field_of_view_margin_px": 60.0, "min_singular_value": 0.8}


@settings(max_examples=40, deadline=None)
@given(TWIST)
def test_closing_speeds_are_the_derivatives_of_the_room(twist: np.ndarray) -> None:
    config, step_s = CONFIG.model_copy(update=NEAR_ALL), 1e-5
    world = World(HOME, config)
    before = {b.name: b for b in world.envelope.barriers(twist, world.around())}
    world.move(twist, step_s)
    after = {b.name: b for b in world.envelope.barriers(twist, world.around())}
    for name in before.keys() & after.keys():
        numeric = (before[name].room - after[name].room) / step_s
        assert before[name].closing == pytest.approx(numeric, abs=3e-3 + 2e-2 * abs(numeric)), name


DRIVES: list[tuple[str, Callable[[World], np.ndarray]]] = [
    ("table (camera)", lambda w: tool_pose(w.q)[:3, :3].T @ [0, 0, -0.15]),
    ("target distance", lambda w: T_TOOL_CAMERA[:3, :3] @ [0, 0, 0.15]),
    ("field of view left", lambda w: T_TOOL_CAMERA[:3, :3] @ [0.15, 0, 0]),
    ("field of view bottom", lambda w: T_TOOL_CAMERA[:3, :3] @ [0, -0.15, 0]),
]


@pytest.mark.parametrize(("name", "velocity"), DRIVES)
def test_driving_at_a_barrier_stops_before_it(
    name: str, velocity: Callable[[World], np.ndarray]
) -> None:
    world = World(np.array([0.0, 0.0, -0.3, 0.1, 0.1, 0.0]))
    twist = np.concatenate([velocity(world), np.zeros(3)])
    world.target_seen = not name.startswith("table")
    blocked = world.drive(twist, 8.0)
    assert blocked == name
    assert 0.0 <= world.barrier(name, twist).room < 0.01


def test_a_joint_stops_before_its_end() -> None:
    world = World(np.array([0.7, 0.0, 0.0, 0.0, 0.0, 0.0]), SafetyConfig(joint_margin_m=0.02))
    world.target_seen = False
    twist = np.concatenate([tool_pose(world.q)[:3, :3].T @ [0.1, 0, 0], np.zeros(3)])
    assert world.drive(twist, 6.0) == "joint x max"
    assert JOINT_HIGH[0] - 0.025 < world.q[0] <= JOINT_HIGH[0] - 0.02


def test_a_singularity_is_approached_ever_more_slowly_and_left_freely() -> None:
    config = SafetyConfig(min_singular_value=0.3, joint_margin_rad=0.0)
    world = World(np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0]), config)
    world.target_seen = False
    tilt = np.array([0, 0, 0, 0, -0.5, 0.0])
    if world.barrier("joint pitch max", tilt).closing < 0.0:
        tilt = -tilt
    assert world.drive(tilt, 4.0) == "singularity"
    stuck = world.q[4]
    smallest = np.linalg.svd(
        np.repeat([10.0, 1.0], 3)[:, None] * tool_jacobian(world.q), compute_uv=False
    )[-1]
    assert smallest == pytest.approx(0.3, abs=0.01)
    world.drive(-tilt, 1.0)
    assert world.q[4] < stuck - 0.3


def test_a_cut_keeps_the_twist_s_direction() -> None:
    world = World(HOME)
    twist = np.concatenate([T_TOOL_CAMERA[:3, :3] @ [0.0, 0.02, 0.13], [0.1, 0.0, 0.2]])
    for _ in range(150):
        allowed = world.limiter.limit(twist, world.around(), DT_S)
        world.move(allowed.twist_tool, DT_S)
        along = allowed.twist_tool @ twist / np.linalg.norm(twist)
        assert np.linalg.norm(allowed.twist_tool) == pytest.approx(along, abs=1e-9)
    assert allowed.reasons


def test_without_an_estimate_or_with_no_positive_radius_no_distance_is_claimed() -> None:
    world = World(HOME)
    around = world.around()
    for target in (None, Estimate(0.0, np.array([0, 0, 14.0]), None, -3.0, None, 0.0)):
        names = [
            b.name
            for b in world.envelope.barriers(
                np.ones(6), Surroundings(around.state, target, None, SHAPE)
            )
        ]
        assert "target distance" not in names


def test_the_room_in_view_is_that_of_the_projected_outline() -> None:
    distorted = Intrinsics(800.0, 800.0, 319.5, 239.5, np.array([-0.1, 0.02, 1e-3, -1e-3, 0.0]))
    for camera in (CAMERA, distorted):
        planes = border_planes(camera, SHAPE, 10.0)
        for s in ([4.0, 1.0, 14.0], [-3.0, -2.5, 13.0], [0.5, 3.0, 15.0]):
            centre = np.array(s)
            outline = _outline(centre)
            pixels = camera.project(outline)
            low = pixels.min(axis=0) - 10.0
            high = np.array([629.0, 469.0]) - pixels.max(axis=0)
            in_px = np.array([low[0], high[0], low[1], high[1]])
            room = room_in_view(centre, None, planes)
            # The border planes lie inside a bent border by what the bend takes: up to 12 px here.
            slack = 1.0 if camera is CAMERA else 14.0
            assert np.all(np.abs(room * 800.0 - in_px) < 0.12 * np.abs(in_px) + slack)


def test_a_cylinder_is_in_view_while_its_two_sides_are() -> None:
    planes = border_planes(CAMERA, SHAPE, 0.0)
    s, axis = np.array([0.0, 0.0, 8.0]), np.array([0.0, 1.0, 0.0])
    room = room_in_view(s, axis, planes)
    assert room[0] == pytest.approx(np.arctan(319.5 / 800) - np.arcsin(1 / 8), abs=2e-3)
    assert room[2] == pytest.approx(np.arctan(239.5 / 800) - 0.08, abs=0.01)


def _outline(s: np.ndarray) -> np.ndarray:
    """Directions (n, 3) on the sphere's tangent cone."""
    n = float(np.linalg.norm(s))
    across = np.linalg.svd(s[None] / n)[2][1:]
    angles = np.linspace(0, 2 * np.pi, 400)
    half = np.arcsin(1 / n)
    ring = np.cos(angles)[:, None] * across[0] + np.sin(angles)[:, None] * across[1]
    return np.asarray(np.cos(half) * s / n + np.sin(half) * ring)


@settings(max_examples=40, deadline=None)
@given(TWIST, st.floats(0.05, 2.0), st.floats(0.1, 1.0))
def test_no_joint_is_asked_for_more_than_its_share_of_its_speed(
    twist: np.ndarray, fastest: float, share: float
) -> None:
    q = np.array([0.0, 0.0, 0.0, 0.1, 1.3, 0.0])  # the wrist close to its singularity
    joints = Joints(
        ("x", "y", "z", "roll", "pitch", "spin"), q, -np.full(6, 9.0), np.full(6, 9.0),
        (True, True, True, False, False, False), tool_jacobian, np.full(6, fastest),
    )  # fmt: skip
    config = SafetyConfig(min_singular_value=0.0, joint_speed_share=share)
    around = Surroundings(ArmState(0.0, tool_pose(q), np.zeros(6)), joints=joints)
    limiter = Limiter(config)
    for _ in range(100):  # until it is up to speed
        allowed = limiter.limit(twist, around, DT_S)
    rates = np.abs(np.linalg.solve(tool_jacobian(q), allowed.twist_tool))
    assert rates.max() <= share * fastest * 1.01
    wanted = np.abs(np.linalg.solve(tool_jacobian(q), twist)).max()
    slower = min(1.0, share * fastest / max(wanted, 1e-12))
    within_speed = min(
        1.0,
        config.max_linear_speed_m_s / max(float(np.linalg.norm(twist[:3])), 1e-12),
        config.max_angular_speed_rad_s / max(float(np.linalg.norm(twist[3:])), 1e-12),
    )
    assert allowed.twist_tool == pytest.approx(
        min(slower, within_speed) * twist, rel=0.02, abs=1e-9
    )
    if slower < 0.9 * within_speed:
        assert any(reason.endswith(" speed") and "joint" in reason for reason in allowed.reasons)
