"""Moving by hand: what the next pose should add, and an arm that takes no commands."""

import numpy as np
import pytest

from drivers.interfaces import ArmState
from rig.calibration.views import PosedView
from rig.calibration_run.errors import PoseRefusedError
from rig.calibration_run.guidance import guide
from rig.calibration_run.onlooker import Onlooker
from sim_backend.clock import SimulatedClock
from tests.rig.calibration.synthetic import SIZE, random_truth, tool_poses, transform, view

TRUTH = random_truth(4)
FRONT = TRUTH.tool_looking(0.4, 0.0, 0.0, 0.0)


def seen(*poses: np.ndarray) -> list[PosedView]:
    rng = np.random.default_rng(3)
    return [PosedView(view(TRUTH, T, rng), T) for T in poses]


def turned(axis: int, degrees: float) -> np.ndarray:
    """The camera goes round the board: about its x, y or z."""
    tilt, azimuth = np.radians(degrees), (0.0, np.pi / 2)[axis % 2]
    if axis == 2:
        return TRUTH.tool_looking(0.4, 0.0, 0.0, tilt)
    return TRUTH.tool_looking(0.4, tilt, azimuth, 0.0)


def test_before_the_first_picture_the_whole_board_is_asked_for() -> None:
    assert "whole board" in guide([], TRUTH.intrinsics, SIZE, 10).missing[0]


def test_one_view_from_the_front_lacks_every_tilt_roll_and_distance() -> None:
    missing = " ".join(guide(seen(FRONT), TRUTH.intrinsics, SIZE, 10).missing)
    for words in ("right", "left", "bottom", "top", "clockwise", "nearer or farther", "9 more"):
        assert words in missing


@pytest.mark.parametrize(
    ("axis", "degrees"), [(0, 20.0), (0, -20.0), (1, 20.0), (1, -20.0), (2, 25.0), (2, -25.0)]
)
def test_a_tilt_or_roll_settles_exactly_what_was_asked_for(axis: int, degrees: float) -> None:
    before = set(guide(seen(FRONT), TRUTH.intrinsics, SIZE, 10).missing)
    after = guide(seen(FRONT, turned(axis, degrees)), TRUTH.intrinsics, SIZE, 10)
    kind = "roll the camera" if axis == 2 else "tilt the camera"
    settled = [one for one in before - set(after.missing) if kind in one]
    assert len(settled) == 1


def test_the_side_that_is_asked_for_is_the_one_that_comes_nearer() -> None:
    for axis, degrees in ((0, 20.0), (0, -20.0), (1, 20.0), (1, -20.0)):
        T = turned(axis, degrees)
        done = guide(seen(FRONT, T), TRUTH.intrinsics, SIZE, 10).done
        side = next(one.split()[0] for one in done if "tilted nearer" in one)
        points = TRUTH.points_m @ TRUTH.camera_from_tool(T)[:3, :3].T
        across = {"right": points[:, 0], "left": -points[:, 0]}
        along = {"bottom": points[:, 1], "top": -points[:, 1]}
        way = (across | along)[side]
        assert np.corrcoef(way, points[:, 2])[0, 1] < -0.9  # further that way is nearer


def test_many_different_views_lack_nothing() -> None:
    poses = tool_poses(TRUTH, 40, seed=1)
    found = guide(seen(*poses), TRUTH.intrinsics, SIZE, 30)
    assert found.missing == ()
    assert len(found.done) == 9


class LedArm:
    """An arm that somebody leads: it moves until it is let go."""

    def __init__(self, clock: SimulatedClock, let_go_s: float) -> None:
        self._clock, self._let_go_s, self._told_s = clock, let_go_s, 0.0

    def read_states(self) -> list[ArmState]:
        times = np.arange(self._told_s, self._clock.now_s(), 0.002)
        self._told_s = self._clock.now_s()
        pose = transform(np.array([0.1, 0.2, 0.3]), np.zeros(3))
        speed = [0.05 * (t < self._let_go_s) for t in times]
        return [
            ArmState(float(t), pose, np.array([v, 0, 0, 0, 0, 0]))
            for t, v in zip(times, speed, strict=True)
        ]

    def command_twist(self, twist_tool: np.ndarray, hold_s: float) -> None:
        raise AssertionError("nobody may command it")

    stop = close = tcp_offset = lambda self: None


def test_an_arm_led_by_hand_is_waited_for_and_never_commanded() -> None:
    clock = SimulatedClock()
    since_s = Onlooker(LedArm(clock, 0.7), clock, lambda: False).settle()
    assert since_s == pytest.approx(0.7, abs=5e-3)
    assert clock.now_s() >= since_s + 0.3


def test_an_arm_that_is_still_led_takes_no_picture() -> None:
    clock = SimulatedClock()
    with pytest.raises(PoseRefusedError, match="let go"):
        Onlooker(LedArm(clock, 1e6), clock, lambda: False).settle()
