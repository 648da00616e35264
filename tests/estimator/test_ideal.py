"""The ideal response against closed forms and a general-purpose integrator."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from estimator.ideal import ideal_response, rms_vs_ideal, time_to_within

FloatArray = NDArray[np.float64]

AT = np.linspace(0.0, 3.0, 91)


def closed_form(alpha: float, sigma: float, damping: float, z0: float) -> FloatArray:
    """The solution for constant σ, z(0) = z0, ż(0) = 0."""
    natural = np.sqrt(alpha) * sigma
    decay = natural * damping
    if damping == 1.0:
        shape = (1.0 + natural * AT) * np.exp(-natural * AT)
    else:
        root = natural * np.emath.sqrt(damping**2 - 1.0)
        growth = np.cosh(root * AT) + decay / root * np.sinh(root * AT)
        shape = np.exp(-decay * AT) * np.real(growth)
    response: FloatArray = z0 * shape
    return response


@pytest.mark.parametrize("alpha", [500.0, 2000.0, 20000.0])
@pytest.mark.parametrize("damping", [0.5, 1.0, 2.0])
def test_constant_sigma_gives_the_closed_form(alpha: float, damping: float) -> None:
    found = ideal_response([0.0, 3.0], [0.0025, 0.0025], alpha, damping, -8.0, AT)
    np.testing.assert_allclose(found, closed_form(alpha, 0.05, damping, -8.0), atol=1e-10)


@pytest.mark.parametrize("damping", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("alpha", [500.0, 200000.0])
def test_varying_sigma_gives_what_a_general_integrator_gives(alpha: float, damping: float) -> None:
    times = np.linspace(0.0, 3.0, 3001)
    ramp = np.minimum(times / 0.5, 1.0)
    sigma2 = (0.05 * ramp * (1.0 + 0.5 * np.sin(3.0 * times))) ** 2

    def rate(t_s: float, y: FloatArray) -> list[float]:
        square = float(np.interp(t_s, times, sigma2))
        c = 2.0 * damping * np.sqrt(alpha * square)
        return [y[1], -c * y[1] - alpha * square * y[0]]

    exact = solve_ivp(rate, (0.0, 3.0), [1.0, 0.0], t_eval=AT, rtol=1e-9, atol=1e-11, max_step=0.01)
    found = ideal_response(times, sigma2, alpha, damping, 1.0, AT)
    np.testing.assert_allclose(found, exact.y[0], atol=1e-5)


def test_nothing_happens_while_the_camera_stands() -> None:
    found = ideal_response([0.0, 1.0], [0.0, 0.0], 2000.0, 1.0, 3.0, [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(found, [3.0, 3.0, 3.0])


def test_what_sigma2_does_not_cover_is_an_error() -> None:
    with pytest.raises(ValueError, match="known from"):
        ideal_response([0.0, 1.0], [1e-3, 1e-3], 2000.0, 1.0, 1.0, [1.1])
    with pytest.raises(ValueError, match="increase"):
        ideal_response([0.0, 0.0], [1e-3, 1e-3], 2000.0, 1.0, 1.0, [0.0])
    with pytest.raises(ValueError, match="negative"):
        ideal_response([0.0, 1.0], [1e-3, -1e-3], 2000.0, 1.0, 1.0, [0.0])
    with pytest.raises(ValueError, match="length"):
        ideal_response([0.0, 1.0], [1e-3], 2000.0, 1.0, 1.0, [0.0])


def test_the_rms_is_relative_to_the_first_error_and_weighted_by_time() -> None:
    t = np.array([0.0, 1.0, 1.1, 1.2, 2.2])
    ideal = np.zeros(5)
    assert rms_vs_ideal(t, np.full(5, -4.0), ideal) == pytest.approx(1.0)
    crowded = np.array([4.0, 0.0, 4.0, 0.0, 0.0])  # a burst of instants counts by its duration
    assert rms_vs_ideal(t, crowded, ideal) == pytest.approx(np.sqrt((0.5 + 0.1) / 2.2))
    with pytest.raises(ValueError, match="zero"):
        rms_vs_ideal(t, np.zeros(5), ideal)


def test_the_time_to_within_is_when_it_stays_within() -> None:
    t = 10.0 + np.arange(6.0)
    assert time_to_within(t, [0.5, 0.005, -0.5, 0.01, -0.01, 0.0], 0.01) == 3.0
    assert time_to_within(t, [0.0] * 6, 0.01) == 0.0
    assert time_to_within(t, [0.0] * 5 + [0.02], 0.01) is None
    assert time_to_within(t, [0.5, 0.0, 0.0, np.nan, 0.0, 0.0], 0.01) == 4.0
