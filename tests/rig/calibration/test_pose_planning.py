"""Planned poses show the board even when the start values are wrong, and are worth taking."""

from itertools import pairwise

import numpy as np
import pytest

from estimator.image.intrinsics import Intrinsics
from rig.calibration.board_pose import board_pose
from rig.calibration.errors import CalibrationError
from rig.calibration.hand_eye import solve_hand_eye
from rig.calibration.hand_eye_model import State
from rig.calibration.intrinsics import fit_intrinsics
from rig.calibration.pose_candidates import PoseLimits, Scene
from rig.calibration.pose_planning import PlannedPose, plan_poses, tour
from rig.calibration.projection import to_vector
from rig.calibration.views import PosedView
from tests.rig.calibration.synthetic import (
    SIZE,
    SQUARE_M,
    Truth,
    inside,
    jitter,
    random_truth,
    transform,
    view,
)

# Off the truths of `random_truth` by up to 15 mm, 5° and 5 %.
NOMINAL = Intrinsics(800.0, 800.0, 319.5, 239.5)
T_TOOL_CAMERA = transform([0.03, -0.02, 0.06], [0.10, -0.08, 0.12])


def first_look(truth: Truth, seed: int) -> Scene:
    """What a user has after one image: rough values and where the board seems to be."""
    T_first = truth.tool_looking(0.4, 0.15, 1.0 + seed, 0.2)
    seen = board_pose(view(truth, T_first, np.random.default_rng(seed)), NOMINAL)
    state = State(T_TOOL_CAMERA, T_first @ T_TOOL_CAMERA @ seen, to_vector(NOMINAL))
    return Scene(state, truth.points_m, SIZE, T_first)


@pytest.mark.parametrize("seed", range(2))
def test_every_planned_pose_shows_the_board_whatever_the_start_values(seed: int) -> None:
    truth = random_truth(seed)
    poses = plan_poses(first_look(truth, seed), 20)
    seen = [int(inside(truth.pixels(one.T_base_tool), 2.0).sum()) for one in poses]
    assert len(poses) == 20
    assert min(seen) >= 8
    assert np.mean(seen) > 15


def test_planned_poses_calibrate_to_the_accuracy_asked_for() -> None:
    for seed in range(2):
        truth, rng = random_truth(seed), np.random.default_rng(seed)
        views = [
            PosedView(
                view(truth, p.T_base_tool, rng, 0.04), p.T_base_tool @ jitter(rng, 5e-6, 1e-5)
            )
            for p in plan_poses(first_look(truth, seed), 30)
        ]
        lens = fit_intrinsics([one.board for one in views], SIZE)
        fit = solve_hand_eye(views, lens.intrinsics, lens.model, SQUARE_M)
        off = np.linalg.inv(truth.T_tool_camera) @ fit.T_tool_camera
        assert 1e3 * np.linalg.norm(off[:3, 3]) < 0.3
        assert np.degrees(np.arccos(min((np.trace(off[:3, :3]) - 1) / 2, 1.0))) < 0.05
        error = to_vector(fit.intrinsics) - to_vector(truth.intrinsics)
        assert np.max(np.abs(error[:2])) < 1e-3 * truth.intrinsics.fx_px
        assert np.max(np.abs(error[2:4])) < 0.5
        assert fit.held_out.px < 0.15
        assert lens.coverage.share > 0.9


def test_planned_poses_keep_the_limits() -> None:
    truth = random_truth(5)
    scene = first_look(truth, 5)
    place = scene.T_base_tool[:3, 3]
    limits = PoseLimits(
        min_distance_m=0.3,
        max_distance_m=0.45,
        max_tilt_rad=0.5,
        workspace_min_m=tuple(place - 0.15),
        workspace_max_m=tuple(place + np.array([0.15, 0.15, 0.05])),
    )
    for one in plan_poses(scene, 15, limits):
        assert np.all(np.abs(one.T_base_tool[:3, 3] - place) <= [0.15, 0.15, 0.15])
        assert one.T_base_tool[2, 3] <= place[2] + 0.05
        assert 0.28 <= one.distance_m <= 0.47  # to the middle, as planned with rough values
        # The board's own slant in the rough scene adds nothing to it.
        assert one.tilt_rad <= 0.5 + 1e-6


def test_each_pose_adds_less_than_the_one_before() -> None:
    gains = [one.gain for one in plan_poses(first_look(random_truth(6), 6), 15)]
    assert all(a >= b > 0.0 for a, b in pairwise(gains))


def test_poses_already_taken_are_not_asked_for_again() -> None:
    scene = first_look(random_truth(7), 7)
    first = plan_poses(scene, 6)
    rest = plan_poses(scene, 6, taken=[one.T_base_tool for one in first])
    assert rest[0].gain < 0.3 * first[0].gain
    places = {tuple(one.T_base_tool[:3, 3].round(9)) for one in first}
    assert not places & {tuple(one.T_base_tool[:3, 3].round(9)) for one in rest}


def test_the_same_seed_plans_the_same_poses() -> None:
    scene = first_look(random_truth(8), 8)
    first, again, other = (plan_poses(scene, 6, seed=seed) for seed in (3, 3, 4))
    assert all(
        np.array_equal(a.T_base_tool, b.T_base_tool) for a, b in zip(first, again, strict=True)
    )
    assert not np.array_equal(first[0].T_base_tool, other[0].T_base_tool)


def test_unreachable_poses_are_passed_over() -> None:
    scene = first_look(random_truth(9), 9)
    free = plan_poses(scene, 10)
    banned = free[0].T_base_tool
    poses = plan_poses(scene, 10, reachable=lambda T: not np.array_equal(T, banned))
    assert len(poses) == 10
    assert not any(np.array_equal(one.T_base_tool, banned) for one in poses)


def test_a_workspace_too_small_says_what_to_widen() -> None:
    scene = first_look(random_truth(10), 10)
    limits = PoseLimits(workspace_min_m=(5.0, 5.0, 5.0), workspace_max_m=(6.0, 6.0, 6.0))
    with pytest.raises(CalibrationError, match=r"widen"):
        plan_poses(scene, 10, limits)


def test_the_tour_visits_every_pose_by_shorter_ways() -> None:
    scene = first_look(random_truth(11), 11)
    poses = plan_poses(scene, 20)
    ordered = tour(poses, scene.T_base_tool)

    def way(path: list[PlannedPose]) -> float:
        places = np.array([scene.T_base_tool[:3, 3], *(one.T_base_tool[:3, 3] for one in path)])
        return float(np.sum(np.linalg.norm(np.diff(places, axis=0), axis=1)))

    assert {id(one) for one in ordered} == {id(one) for one in poses}
    assert way(ordered) < 0.8 * way(poses)
