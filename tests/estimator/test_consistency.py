"""What the filter says about its own errors is true, over 200 seeds."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from tests.estimator.exact_motion import BALL, PIPE, Target, lively
from tests.estimator.noisy_images import NoisyArm, estimates, guessed
from tests.estimator.responses import MOTION, REGULAR, irregular

FloatArray = NDArray[np.float64]

SEEDS = 200
DURATION_S = 1.0
ARM = NoisyArm(lively(0.05, 0.3), DURATION_S)
# Where so many stated variances are true, the mean of the normalised errors squared lies here.
LOW, HIGH = chi2.ppf([0.025, 0.975], SEEDS) / SEEDS

every_image = REGULAR[REGULAR < DURATION_S]
jittered = irregular(6)[irregular(6) < DURATION_S]
few_images = jittered[::3]


@pytest.mark.parametrize(
    ("target", "noise_px", "stamps"),
    [
        pytest.param(BALL, 0.002, every_image, id="sphere, clean"),
        pytest.param(PIPE, 0.05, every_image, id="cylinder, hard"),
        pytest.param(PIPE, 0.01, jittered, id="cylinder, laggy"),
        pytest.param(BALL, 0.01, few_images, id="sphere, lossy"),
        pytest.param(BALL, 0.1, every_image, id="sphere, hard", marks=pytest.mark.slow),
        pytest.param(PIPE, 0.002, every_image, id="cylinder, clean", marks=pytest.mark.slow),
        pytest.param(BALL, 0.01, jittered, id="sphere, laggy", marks=pytest.mark.slow),
        pytest.param(PIPE, 0.01, few_images, id="cylinder, lossy", marks=pytest.mark.slow),
    ],
)
def test_errors_are_as_large_as_stated(target: Target, noise_px: float, stamps: FloatArray) -> None:
    exact = [MOTION.feature(target, t_s) for t_s in stamps]
    normalised = []
    for seed in range(SEEDS):
        *_, last = estimates(guessed(target), stamps, exact, ARM, noise_px, seed)
        assert last.variance is not None
        assert last.doubt == ""
        normalised.append((last.chi - 1.0 / target.radius_m) ** 2 / last.variance)
    assert LOW <= np.mean(normalised) <= HIGH
