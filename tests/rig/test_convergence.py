"""A run that ends by its stated interval has the truth inside it, as often as stated."""

import numpy as np

from estimator.estimate import DEVIATIONS_95
from tests.estimator.exact_motion import BALL, lively
from tests.estimator.noisy_images import NoisyArm, estimates, guessed
from tests.estimator.responses import MOTION, REGULAR

SEEDS = 200
SHARE = 0.005


def test_the_truth_is_inside_the_stated_interval_in_95_of_100_runs() -> None:
    stamps = REGULAR[REGULAR < 1.2]
    exact = [MOTION.feature(BALL, t_s) for t_s in stamps]
    arm = NoisyArm(lively(0.05, 0.3), 1.2)
    inside, stopped_s = [], []
    for seed in range(SEEDS):
        for estimate in estimates(guessed(BALL), stamps, exact, arm, 0.05, seed):
            if estimate.interval_share <= SHARE:
                break
        low_m, high_m = estimate.radius_interval_m(DEVIATIONS_95)
        assert low_m is not None and high_m is not None
        inside.append(low_m <= BALL.radius_m <= high_m)
        stopped_s.append(estimate.t_s)
    assert max(stopped_s) < stamps[-1]  # every run ended by the rule
    assert 0.93 <= np.mean(inside) <= 0.97
