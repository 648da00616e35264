"""Latency from a wiggle: well within a millisecond, or an error that says what was wrong."""

from dataclasses import replace

import numpy as np
import pytest

from rig.calibration import se3
from rig.calibration.errors import CalibrationError
from rig.calibration.excitation import Excitation
from rig.calibration.hand_eye_model import State
from rig.calibration.latency import LatencyFit, fit_latency
from rig.calibration.latency_coarse import coarse_latency
from rig.calibration.projection import to_vector
from rig.calibration.trajectory import Trajectory
from rig.calibration.views import BoardView, StampedView
from tests.rig.calibration.synthetic import Truth, random_truth, tool_poses, transform
from tests.rig.calibration.synthetic_motion import Session, wiggle_session

# What a hand-eye step leaves: 0.1 mm and 0.3 mrad.
COVARIANCE = np.diag(np.repeat([1e-4, 3e-4], 3) ** 2)


def nearly(truth: Truth, seed: int) -> State:
    """The truth as a hand-eye step would have found it."""
    off = np.sqrt(np.diag(COVARIANCE)) * np.random.default_rng(seed).standard_normal(6)
    X = truth.T_tool_camera @ se3.exp(off)
    return State(X, truth.T_base_board, to_vector(truth.intrinsics))


def fitted(session: Session, truth: Truth, seed: int, rolling: bool = False) -> LatencyFit:
    return fit_latency(
        session.halves, session.arm, nearly(truth, seed), COVARIANCE, 480, rolling=rolling
    )


@pytest.mark.parametrize("latency_s", [-0.06, 0.04, 0.3])
def test_the_latency_is_found_from_far_away_within_its_deviation(latency_s: float) -> None:
    seed = round(1e3 * latency_s) + 100
    truth = random_truth(seed)
    fit = fitted(wiggle_session(truth, seed, latency_s), truth, seed)
    assert abs(fit.latency_s - latency_s) < 4.0 * fit.std_s
    assert abs(fit.latency_s - latency_s) < 2e-4
    assert fit.std_s < 1e-3
    assert fit.correlation > 0.95


def test_a_rolling_shutter_is_found_along_with_it() -> None:
    truth = random_truth(3)
    session = wiggle_session(truth, 3, 0.05, row_time_s=3e-5)
    fit = fitted(session, truth, 3, rolling=True)
    assert abs(fit.row_time_s - 3e-5) < 4.0 * fit.row_time_std_s
    assert fit.row_time_std_s < 2e-6
    assert abs(fit.latency_s - 0.05) < 4.0 * fit.std_s


def test_jittering_stamps_widen_the_deviation() -> None:
    truth = random_truth(4)
    steady = fitted(wiggle_session(truth, 4, 0.04), truth, 4)
    jittering = fitted(wiggle_session(truth, 4, 0.04, jitter_s=0.002), truth, 4)
    assert jittering.std_s > 3.0 * steady.std_s
    assert abs(jittering.latency_s - 0.04) < 4.0 * jittering.std_s


def test_a_slowly_reporting_arm_still_gives_the_latency() -> None:
    truth = random_truth(5)
    fit = fitted(wiggle_session(truth, 5, 0.03, arm_hz=50.0), truth, 5)
    assert abs(fit.latency_s - 0.03) < 1e-3


def test_a_camera_that_hardly_moves_is_refused() -> None:
    truth = random_truth(6)
    with pytest.raises(CalibrationError, match="too slowly to time it"):
        fitted(wiggle_session(truth, 6, 0.04, shrink=0.03), truth, 6)


def test_one_segment_is_not_enough() -> None:
    truth = random_truth(7)
    session = wiggle_session(truth, 7, 0.04)
    with pytest.raises(CalibrationError, match="at least two"):
        fit_latency([session.views], session.arm, nearly(truth, 7), COVARIANCE, 480)


def test_segments_with_different_delays_are_refused_with_both_values() -> None:
    truth = random_truth(8)
    session = wiggle_session(truth, 8, 0.04)
    first, second = session.halves
    late = [replace(one, t_s=one.t_s + 0.01) for one in second]
    with pytest.raises(CalibrationError, match=r"disagree.* 40\.\d+ .* (49\.9|50\.0)"):
        fit_latency([first, late], session.arm, nearly(truth, 8), COVARIANCE, 480)


def test_a_motion_that_repeats_itself_is_refused() -> None:
    truth = random_truth(9)
    X, first = truth.T_tool_camera, tool_poses(truth, 1, 9)[0]
    session = wiggle_session(truth, 9, 0.0)

    def tool(times_s: np.ndarray) -> np.ndarray:
        turn = np.zeros((len(times_s), 6))
        turn[:, 4] = 0.03 * np.sin(2 * np.pi * 3.0 * times_s)
        return first @ X @ se3.exp(turn) @ np.linalg.inv(X)

    times = np.arange(-1.0, 6.0, 0.002)
    views = []
    for one in session.views:
        pixels = truth.pixels(tool(np.array([one.t_s]))[0])[one.board.ids]
        views.append(replace(one, board=replace(one.board, pixels=pixels)))
    half = len(views) // 2
    with pytest.raises(CalibrationError, match="repeats itself"):
        fit_latency(
            [views[:half], views[half:]],
            Trajectory(times, tool(times)),
            nearly(truth, 9),
            COVARIANCE,
            480,
        )


def test_images_of_another_motion_are_refused() -> None:
    truth = random_truth(10)
    session, other = wiggle_session(truth, 10, 0.0), wiggle_session(truth, 11, 0.0)
    with pytest.raises(CalibrationError, match="does not move as the arm"):
        fitted(Session(session.views, other.arm), truth, 10)


def test_an_arm_record_that_misses_the_images_is_refused() -> None:
    truth = random_truth(12)
    session = wiggle_session(truth, 12, 0.0)
    moved = [replace(one, t_s=one.t_s + 100.0) for one in session.views]
    with pytest.raises(CalibrationError, match="overlaps"):
        fitted(Session(moved, session.arm), truth, 12)


def test_poses_between_samples_lie_on_the_screw_between_them() -> None:
    # Pointing down, where rotation vectors flip their sign.
    first = transform([0.1, 0.2, 0.3], [np.pi * 0.9999, 0.0, 0.0])
    twist = np.array([0.02, -0.01, 0.03, 0.3, 0.2, -0.4])
    times = np.linspace(0.0, 1.0, 21)
    arm = Trajectory(times, first @ se3.exp(times[:, None] * twist))
    asked = np.array([0.0, 0.333, 0.51, 1.0])
    assert np.allclose(arm.poses(asked), first @ se3.exp(asked[:, None] * twist), atol=1e-12)
    assert np.allclose(arm.twists(asked[1:3]), twist, atol=1e-9)


def test_poses_outside_the_record_are_an_error_not_a_guess() -> None:
    arm = Trajectory([0.0, 0.1], np.array([np.eye(4)] * 2))
    with pytest.raises(CalibrationError, match="outside its record"):
        arm.poses(np.array([0.11]))


@pytest.mark.parametrize(
    ("times", "message"),
    [([0.0], "at least two"), ([0.0, 0.0], "do not increase"), ([0.0, 0.1, 0.9], "silent for 0.8")],
)
def test_a_broken_record_is_refused(times: list[float], message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        Trajectory(times, np.array([np.eye(4)] * len(times)))


def test_the_wiggle_starts_and_ends_at_rest_where_it_began() -> None:
    motion = Excitation(5.0, seed=2)
    for t in (0.0, 5.0):
        assert np.allclose(motion.displacement(t), 0.0, atol=1e-9)
        assert np.allclose(motion.twist_camera(t), 0.0, atol=1e-4)
    linear, angular = motion.top_speed
    assert 0.02 < linear < 0.25
    assert 0.05 < angular < 0.7
    largest = np.max([np.abs(motion.displacement(t)) for t in np.arange(0, 5, 0.01)], axis=0)
    assert np.all(largest <= [0.015, 0.015, 0.0, 0.04, 0.04, 0.04])


def test_the_wiggles_rate_is_the_derivative_of_its_displacement() -> None:
    motion = Excitation(4.0, seed=3)
    moved = sum(motion.twist_camera(t) * 0.001 for t in np.arange(0.0005, 1.7, 0.001))
    assert np.allclose(moved, motion.displacement(1.7), atol=1e-6)


def test_a_record_whose_end_no_step_meets_exactly_is_searched_to_its_end() -> None:
    times = 75.5 + 0.002 * np.arange(6555)  # np.arange(start, end, step) goes past this end
    arm = Trajectory(times, np.broadcast_to(np.eye(4), (len(times), 4, 4)))
    at_rest = State(np.eye(4), np.eye(4), np.array([800.0, 800, 319.5, 239.5, 0, 0, 0, 0, 0]))
    x, y = np.mgrid[:3, :3] * 0.05
    points = np.stack([x.ravel(), y.ravel(), np.zeros(9)], axis=1)
    pixels = [800.0 * points[:, :2] / 0.4 + 100.0 + 5.0 * (k % 3) for k in range(60)]
    views = [
        StampedView(BoardView(np.arange(9), points, seen), 80.0 + k / 30.0)
        for k, seen in enumerate(pixels)
    ]
    with pytest.raises(CalibrationError, match="does not move as the arm does"):
        coarse_latency(views, arm, at_rest, 0.5)
