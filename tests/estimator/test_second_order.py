"""The exact step of (5) is the matrix exponential, for every damping, and never overflows."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from estimator.second_order import exact_step


@given(
    alpha=st.floats(1.0, 2e5),
    sigma=st.floats(0.0, 0.5),
    damping=st.floats(0.0, 4.0),
    duration_s=st.floats(1e-6, 0.2),
)
@example(alpha=2000.0, sigma=0.05, damping=1.0, duration_s=0.002)  # critical
@example(alpha=2000.0, sigma=0.0, damping=1.0, duration_s=0.1)  # at rest
@settings(max_examples=300, deadline=None, derandomize=True)
def test_the_step_is_the_matrix_exponential(
    alpha: float, sigma: float, damping: float, duration_s: float
) -> None:
    c = damping * 2.0 * np.sqrt(alpha) * sigma
    step = exact_step(alpha, np.array(sigma**2), np.array(c), np.array(duration_s))
    exact = expm(duration_s * np.array([[0.0, -alpha], [sigma**2, -c]]))
    # In units that make both coordinates alike: w scales with z σ / √α.
    unit = max(sigma, 1e-3) / np.sqrt(alpha)
    scale = np.array([[1.0, unit], [1.0 / unit, 1.0]])
    found = np.array([[step.zz, step.zw], [step.wz, step.ww]]) * scale
    np.testing.assert_allclose(found, exact * scale, atol=1e-9, rtol=1e-9)


@pytest.mark.parametrize("c", [1e3, 1e6])
def test_heavy_damping_forgets_w_and_keeps_z(c: float) -> None:
    step = exact_step(2000.0, np.array(1e-8), np.array(c), np.array(0.1))
    np.testing.assert_allclose(step.zz, np.exp(-2e-5 / c * 0.1), rtol=1e-6)
    assert abs(step.ww) < 1e-10


def test_two_half_steps_make_a_whole_one() -> None:
    sigma2 = np.array([1e-4, 2.5e-3, 0.04])
    c = 2.0 * np.sqrt(5000.0 * sigma2)
    half = exact_step(5000.0, sigma2, c, np.array(0.01))
    whole = exact_step(5000.0, sigma2, c, np.array(0.02))
    np.testing.assert_allclose(half.zz**2 + half.zw * half.wz, whole.zz, rtol=1e-12)
    np.testing.assert_allclose(half.wz * half.zw + half.ww**2, whole.ww, rtol=1e-11)
