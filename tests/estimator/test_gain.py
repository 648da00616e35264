"""H makes the observer (2), written down literally, obey (5), whatever Ω does."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from estimator.gain import H, damping_rates, rest_rates
from estimator.ideal import ideal_response
from estimator.models.limb_plane import LimbPlane, moments_of

FloatArray = NDArray[np.float64]
OmegaOf = Callable[[float], FloatArray]

AT = np.linspace(0.0, 2.0, 21)
ALPHA = 2000.0


def turning(t_s: float) -> FloatArray:
    """One row whose norm and direction both change."""
    direction = np.array([np.cos(1.5 * t_s), np.sin(1.5 * t_s), 0.4 * np.sin(3.0 * t_s)])
    row: FloatArray = -(0.04 + 0.02 * np.sin(2.0 * t_s)) * direction[None, :]
    return row


def turning_pair(t_s: float) -> FloatArray:
    """Two rows in four dimensions, neither orthogonal nor of one length."""
    c, s = np.cos(t_s), np.sin(t_s)
    rows = [[0.05 * c, 0.05 * s, 0.01, 0.0], [0.01 * s, 0.02, 0.03 * c, 0.03 * s]]
    return np.array(rows)


def derivative(Omega: OmegaOf, t_s: float) -> FloatArray:
    rate: FloatArray = (Omega(t_s + 1e-5) - Omega(t_s - 1e-5)) / 2e-5
    return rate


def literal_error(Omega: OmegaOf, z0: FloatArray, damping: float, Omega_dot: OmegaOf) -> FloatArray:
    """z (p, n) of the error system (3) with H, from ξ = 0."""
    m = Omega(0.0).shape[1]

    def rate(t_s: float, e: FloatArray) -> FloatArray:
        xi, z = e[:m], e[m:]
        now = Omega(t_s)
        gain = H(now, Omega_dot(t_s), ALPHA, damping)
        return np.concatenate((-gain @ xi + now.T @ z, -ALPHA * now @ xi))

    start = np.concatenate((np.zeros(m), z0))
    solution = solve_ivp(rate, (0.0, AT[-1]), start, t_eval=AT, rtol=1e-9, atol=1e-12)
    z: FloatArray = solution.y[m:]
    return z


def ideal(damping: float) -> FloatArray:
    t_s = np.linspace(0.0, AT[-1], 4001)
    sigma2 = np.array([float((turning(t) ** 2).sum()) for t in t_s])
    return ideal_response(t_s, sigma2, ALPHA, damping, 1.0, AT)


@pytest.mark.parametrize("damping", [0.5, 1.0, 2.0])
def test_the_error_obeys_eq_5_while_omega_turns_and_stretches(damping: float) -> None:
    z = literal_error(turning, np.ones(1), damping, lambda t: derivative(turning, t))
    np.testing.assert_allclose(z[0], ideal(damping), atol=1e-5)


def test_without_the_terms_in_the_rate_of_omega_it_does_not() -> None:
    z = literal_error(turning, np.ones(1), 1.0, lambda t: np.zeros((1, 3)))
    assert np.abs(z[0] - ideal(1.0)).max() > 1e-2


@pytest.mark.parametrize("t_s", [0.0, 0.7, 1.9])
def test_with_one_unknown_h_is_what_errata_says(t_s: float) -> None:
    damping, step = 1.3, 1e-5
    row = turning(t_s)[0]
    sigma = float(np.linalg.norm(row))
    u = row / sigma
    sides = [turning(t_s + h)[0] for h in (-step, step)]
    norms = [float(np.linalg.norm(side)) for side in sides]
    u_dot = (sides[1] / norms[1] - sides[0] / norms[0]) / (2 * step)
    sigma_dot = (norms[1] - norms[0]) / (2 * step)
    c = damping * 2.0 * np.sqrt(ALPHA) * sigma
    uu = np.outer(u, u)
    expected = c * np.eye(3) + np.outer(u, u_dot) + sigma_dot / sigma * uu
    found = H(turning(t_s), derivative(turning, t_s), ALPHA, damping)
    np.testing.assert_allclose(found, expected, atol=1e-7)


def test_with_two_unknowns_each_eigenvalue_damps_its_own_coordinate() -> None:
    z0 = np.array([1.0, -0.5])
    z = literal_error(turning_pair, z0, 1.0, lambda t: derivative(turning_pair, t))

    def rate(t_s: float, y: FloatArray) -> FloatArray:
        now = turning_pair(t_s)
        squares, U = np.linalg.eigh(now @ now.T)
        C = U @ np.diag(2.0 * np.sqrt(ALPHA * squares)) @ U.T
        return np.concatenate((y[2:], -C @ y[2:] - ALPHA * now @ now.T @ y[:2]))

    start = np.concatenate((z0, np.zeros(2)))
    exact = solve_ivp(rate, (0.0, AT[-1]), start, t_eval=AT, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(z, exact.y[:2], atol=1e-6)


def test_constant_omega_with_two_unknowns_decouples_into_eq_5() -> None:
    fixed = turning_pair(0.3)
    squares, U = np.linalg.eigh(fixed @ fixed.T)
    z = literal_error(lambda t: fixed, U @ np.array([1.0, 2.0]), 1.0, lambda t: 0.0 * fixed)
    for eta, square, start in zip(U.T @ z, squares, (1.0, 2.0), strict=True):
        expected = ideal_response([0.0, 2.0], [square, square], ALPHA, 1.0, start, AT)
        np.testing.assert_allclose(eta, expected, atol=1e-6)


def limb(v: FloatArray) -> FloatArray:
    """Ω (3, 5) of a sphere's limb plane, in units that make its σ_i comparable to those above."""
    scale = np.diag([1.0, 1.0, 30.0, 30.0, 30.0])
    Omega: FloatArray = LimbPlane().Omega(moments_of(np.array([2.7, -1.9, 6.0])), v) @ scale
    return Omega


@pytest.mark.parametrize("damping", [0.5, 1.0, 2.0])
def test_a_limb_planes_three_unknowns_decouple_into_eq_5(damping: float) -> None:
    fixed = limb(np.array([0.1, -0.3, 0.4]))
    squares, U = np.linalg.eigh(fixed @ fixed.T)
    assert squares[0] > 1e-3 * squares[1] > 0.0
    z0 = np.array([1.0, -2.0, 3.0])
    z = literal_error(lambda t: fixed, U @ z0, damping, lambda t: 0.0 * fixed)
    for eta, square, start in zip(U.T @ z, squares, z0, strict=True):
        expected = ideal_response([0.0, 2.0], [square, square], ALPHA, damping, start, AT)
        np.testing.assert_allclose(eta, expected, atol=1e-5)


def test_for_a_constant_omega_h_is_the_published_v_diag_v_t() -> None:
    """H = V diag(D1, D2) Vᵀ with Ω = U (Σ 0) Vᵀ and D1 = diag(c_i)."""
    fixed = limb(np.array([0.1, -0.3, 0.4]))
    _, sigma, Vt = np.linalg.svd(fixed)
    c = damping_rates(sigma, ALPHA, 0.8)
    np.testing.assert_allclose(c, 0.8 * 2.0 * np.sqrt(ALPHA) * sigma)
    expected = Vt.T @ np.diag(np.concatenate((c, [c.max(), c.max()]))) @ Vt
    np.testing.assert_allclose(H(fixed, 0.0 * fixed, ALPHA, 0.8), expected, rtol=1e-9, atol=1e-9)


def test_while_a_limb_plane_moves_its_error_obeys_the_matrix_form_of_eq_5() -> None:
    """z̈ + C ż + α Ω Ωᵀ z = 0: for p > 1 turning eigenvectors couple the coordinates of (5)."""

    def moving(t_s: float) -> FloatArray:
        return limb(np.array([0.1 + 0.1 * np.sin(t_s), -0.3 * np.cos(2.0 * t_s), 0.4]))

    z0 = np.array([1.0, -0.5, 0.3])
    z = literal_error(moving, z0, 1.0, lambda t: derivative(moving, t))

    def rate(t_s: float, y: FloatArray) -> FloatArray:
        squares, U = np.linalg.eigh(moving(t_s) @ moving(t_s).T)
        C = (U * damping_rates(np.sqrt(squares), ALPHA, 1.0)) @ U.T
        return np.concatenate((y[3:], -C @ y[3:] - ALPHA * (U * squares) @ U.T @ y[:3]))

    start = np.concatenate((z0, np.zeros(3)))
    exact = solve_ivp(rate, (0.0, AT[-1]), start, t_eval=AT, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(z, exact.y[:3], atol=1e-5)


def test_h_is_refused_at_rest() -> None:
    with pytest.raises(ValueError, match="positive"):
        H(np.zeros((1, 3)), np.zeros((1, 3)), ALPHA, 1.0)


def test_damping_is_a_multiple_of_the_critical_one() -> None:
    assert damping_rates(np.array(0.05), 2000.0, 2.0) == pytest.approx(0.2 * np.sqrt(2000.0))


def test_w_is_forgotten_only_after_a_while_of_rest() -> None:
    sigma = np.array([[0.0, 0.05], [0.0, 0.0], [5e-4, 0.0], [0.05, 0.0]])
    rates, rested_s = rest_rates(sigma, np.full(4, 0.03), np.array([0.0, 1.0]))
    np.testing.assert_allclose(rates, [[0.0, 0.0], [1000.0, 0.0], [250.0, 1000.0], [0.0, 1000.0]])
    np.testing.assert_allclose(rested_s, [0.0, 0.09], atol=1e-15)
    rates, rested_s = rest_rates(np.zeros((1, 1)), np.array([0.002]), np.array([0.08]))
    np.testing.assert_allclose(rates, [[1000.0]])
    np.testing.assert_allclose(rested_s, [0.082])
