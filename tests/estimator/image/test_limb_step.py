"""The outline's steps: too long ones are shortened, and lengths are told in deviations."""

import numpy as np
import pytest

from estimator.image.limb_step import shorten, step_in_deviations

INFORMATION = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 0.5], [0.0, 0.5, 1.0]])
START = np.array([1.0, -2.0, 3.0])


@pytest.mark.parametrize("too_long", [1.0, 1.5, 2.0, 2.6])
def test_steps_that_are_all_too_long_by_the_same_share_soon_arrive(too_long: float) -> None:
    left, before, divisor = START.copy(), np.zeros(3), 1.0
    for _ in range(3):
        step = -too_long * left
        divisor = shorten(INFORMATION, before, step, divisor)
        left, before = left + step, step
    assert divisor == pytest.approx(too_long)
    assert np.linalg.norm(left) < 1e-9


def test_steps_that_fall_short_are_taken_as_they_are() -> None:
    before, step = 0.8 * START, 0.16 * START
    assert shorten(INFORMATION, before, step, 1.0) == 1.0
    assert step == pytest.approx(0.16 * START)


def test_a_step_of_one_deviation_of_one_number_has_length_one() -> None:
    step = np.array([0.0, 1.0 / 3.0, 100.0])
    assert step_in_deviations(INFORMATION, step, 2) == pytest.approx(1.0)
