"""The whole loop in arithmetic: late images, a lagging noisy arm, the controller in between."""

import copy

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.active.controller import Controller
from estimator.active.policy import ConstantVelocity, PaperPolicy, VelocityPolicy
from estimator.ideal import ideal_response, rms_vs_ideal
from estimator.models.cylinder import Cylinder
from estimator.models.sphere import Sphere
from estimator.observer import Observer
from tests.estimator.closed_loop import Conditions, Run, drive
from tests.estimator.exact_motion import BALL, PIPE, Target

FloatArray = NDArray[np.float64]


def run(
    target: Target,
    policy: VelocityPolicy,
    conditions: Conditions,
    duration_s: float = 4.0,
    alpha: float = 20000.0,
    damping: float = 1.0,
) -> Run:
    model = Sphere() if target.axis is None else Cylinder()
    observer = Observer(model, alpha, damping, 1.5 * target.radius_m)
    return drive(target, observer, Controller(policy), duration_s, conditions)


def offset_px(result: Run) -> FloatArray:
    """How far off the image's centre the target is, (n,)."""
    offset: FloatArray = 800.0 * np.hypot(*(result.s[:, :2] / result.s[:, 2:]).T)
    return offset


def cases() -> list[tuple[Target, VelocityPolicy]]:
    return [
        (BALL, ConstantVelocity([-0.05, 0.0, 0.0])),
        (BALL, PaperPolicy([0.0, 0.045, 0.02], 10.0, 1.0)),
        (PIPE, PaperPolicy([-0.01, 0.05, 0.05], 10.0, 1.0)),
        (PIPE, PaperPolicy([-0.05, 0.05, 0.01], 10.0, 1.0)),
    ]


@pytest.mark.parametrize("latency_s", [0.0, 0.08])
@pytest.mark.parametrize("case", range(4))
def test_the_target_is_centred_and_stays_there(case: int, latency_s: float) -> None:
    target, policy = cases()[case]
    jitter_s = min(latency_s, 0.02)
    result = run(target, policy, Conditions(latency_s=latency_s, jitter_s=jitter_s), 2.5)
    offset = offset_px(result)
    assert offset[0] > 30.0
    assert offset[result.t_s > 1.5].max() < 2.0
    assert offset.max() < 1.05 * offset[0]


@pytest.mark.parametrize("case", range(4))
def test_the_turning_rate_is_smooth(case: int) -> None:
    target, policy = cases()[case]
    result = run(target, policy, Conditions(s_noise=1e-3), 2.5)
    settled = result.command[result.t_s > 1.5, 3:]
    assert np.abs(np.diff(settled, axis=0)).max() < 0.02  # rad/s from tick to tick
    assert np.linalg.norm(settled, axis=1).max() < 0.6


@pytest.mark.parametrize("case", range(4))
def test_latency_jitter_and_drops_do_not_show_in_the_radius(case: int) -> None:
    target, _ = cases()[case]
    errors = []
    for conditions in (Conditions(0.0, 0.0, 0.0), Conditions(0.08, 0.03, 0.1)):
        result = run(target, cases()[case][1], conditions, 3.0)
        errors.append(1.0 / result.inverse_radius[-1] / target.radius_m - 1.0)
    assert abs(errors[1]) < 2e-3
    assert abs(errors[1] - errors[0]) < 2e-3


PAPER: list[tuple[Target, VelocityPolicy, float, float]] = [
    (BALL, ConstantVelocity([-0.05, 0.0, 0.0]), 2000.0, 1.0),  # fig. 3 and 4
    (BALL, ConstantVelocity([0.0, 0.045, 0.02]), 2000.0, 1.0),
    (BALL, ConstantVelocity([-0.05, 0.0, 0.0]), 2000.0, 2.0),
    (BALL, ConstantVelocity([-0.05, 0.0, 0.0]), 2000.0, 0.5),
    (PIPE, PaperPolicy([-0.01, 0.05, 0.05], 10.0, 1.0), 500.0, 1.0),  # fig. 5
    (PIPE, PaperPolicy([-0.01, 0.05, 0.05], 10.0, 0.0), 500.0, 1.0),
    (PIPE, PaperPolicy([-0.05, 0.05, 0.01], 10.0, 1.0), 500.0, 1.0),
]


@pytest.mark.parametrize("index", range(len(PAPER)))
def test_each_of_the_papers_curves_is_the_ideal_one_under_a_real_rigs_conditions(
    index: int,
) -> None:
    target, policy, alpha, damping = PAPER[index]
    conditions = Conditions(latency_s=0.04, jitter_s=0.01, dropped=0.0, s_noise=1e-3)
    result = run(target, copy.deepcopy(policy), conditions, 4.0, alpha, damping)
    t_s, z = result.image_t_s, 1.0 / target.radius_m - result.image_inverse_radius
    known = result.arm_t_s >= t_s[0]
    expected = ideal_response(
        result.arm_t_s[known], result.sigma2[known], alpha, damping, z[0], t_s
    )
    assert rms_vs_ideal(t_s, z, expected) < 1.2e-3


@pytest.mark.parametrize(("index", "reached"), [(4, True), (5, False), (6, True)])
def test_sigma2_reaches_the_square_of_the_speed_only_with_the_active_term(
    index: int, reached: bool
) -> None:
    target, policy, alpha, damping = PAPER[index]
    result = run(target, copy.deepcopy(policy), Conditions(), 4.0, alpha, damping)
    share = result.sigma2[-1] / 0.0051
    assert (share > 0.99) == reached


def test_from_a_velocity_along_the_axis_the_cylinder_is_still_measured() -> None:
    assert PIPE.axis is not None
    result = run(PIPE, PaperPolicy(0.07 * PIPE.axis, 10.0, 1.0), Conditions(), 6.0)
    assert abs(1.0 / result.inverse_radius[-1] / PIPE.radius_m - 1.0) < 5e-3
    assert offset_px(result)[-1] < 2.0


def test_the_same_seed_gives_the_same_run() -> None:
    first, second = (run(BALL, cases()[0][1], Conditions(), 1.0) for _ in range(2))
    np.testing.assert_array_equal(first.command, second.command)
    np.testing.assert_array_equal(first.inverse_radius, second.inverse_radius)
