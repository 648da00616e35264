"""σ_i² of any model, and their gradients in v and s, against finite differences."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.active.sigma2 import J_a, J_v
from estimator.active.spectrum import (
    least_sigma2,
    sigma2_jacobian,
    spectrum,
    structure_along,
    structure_by_s,
    structure_by_v,
)
from estimator.models.bearings import Bearings
from estimator.models.cylinder import Cylinder
from estimator.models.limb_plane import LimbPlane, moments_of
from estimator.models.model import Model
from estimator.models.points import Points
from estimator.models.sphere import Sphere
from tests.estimator.exact_points import THREE, truth

FloatArray = NDArray[np.float64]

V = np.array([0.03, -0.04, 0.025])
AXIS = np.array([0.35, 0.9, 0.2]) / np.linalg.norm([0.35, 0.9, 0.2])
LIMB_S = moments_of(np.array([2.7, -1.9, 6.0]))
PLANAR_S, _ = truth(Points(3), THREE)
CASES = [
    pytest.param(Sphere(), np.array([0.5, -1.0, 14.0]), id="sphere"),
    pytest.param(Cylinder(), np.concatenate(([0.5, -1.0, 9.0], AXIS)), id="cylinder"),
    pytest.param(Points(1), PLANAR_S[:2], id="one point"),
    pytest.param(Points(3), PLANAR_S, id="points"),
    pytest.param(Bearings(3), truth(Bearings(3), THREE)[0], id="bearings"),
    pytest.param(LimbPlane(), LIMB_S, id="limb plane"),
]


def slopes(model: Model, s: FloatArray, v: FloatArray, of_s: bool) -> tuple[FloatArray, FloatArray]:
    """The eigenvalues of Ω Ωᵀ (p,), and their slopes (p, k) by differences of themselves."""

    def eigenvalues(at: FloatArray) -> FloatArray:
        Omega = model.Omega(at, v) if of_s else model.Omega(s, at)
        found: FloatArray = np.linalg.svd(Omega, compute_uv=False)[::-1] ** 2
        return found

    start = s if of_s else v
    h = 1e-5 * np.maximum(np.abs(start), 0.02)
    columns = [
        (eigenvalues(start + step) - eigenvalues(start - step)) / (2.0 * size)
        for step, size in zip(np.diag(h), h, strict=True)
    ]
    return eigenvalues(start), np.stack(columns, axis=1)


@pytest.mark.parametrize(("model", "s"), CASES)
def test_the_singular_values_take_omega_apart(model: Model, s: FloatArray) -> None:
    Omega = model.Omega(s, V)
    found = spectrum(Omega)
    assert found.sigma.size == model.p
    assert np.all(np.diff(found.sigma) >= 0.0)
    np.testing.assert_allclose((found.U * found.sigma) @ found.V.T, Omega, atol=1e-15)
    np.testing.assert_allclose(
        Omega @ Omega.T @ found.U, found.U * found.sigma2, atol=1e-14 * found.sigma2[-1]
    )


@pytest.mark.parametrize(("model", "s"), CASES)
def test_the_gradients_in_v_are_those_of_the_eigenvalues(model: Model, s: FloatArray) -> None:
    B = structure_by_v(model, s)
    np.testing.assert_allclose(B @ V, model.Omega(s, V), atol=1e-16)
    values, expected = slopes(model, s, V, of_s=False)
    found = sigma2_jacobian(spectrum(B @ V), B)
    # Each row on its own scale: a limb plane's σ1² is a millionth of its σ3².
    scale = (values / np.linalg.norm(V))[:, None]
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-5)


@pytest.mark.parametrize(("model", "s"), CASES)
def test_the_gradients_in_s_are_those_of_the_eigenvalues(model: Model, s: FloatArray) -> None:
    Omega_s = structure_by_s(model, s, V)
    values, expected = slopes(model, s, V, of_s=True)
    found = sigma2_jacobian(spectrum(model.Omega(s, V)), Omega_s)
    np.testing.assert_allclose(
        found * np.abs(s) / values[:, None],
        expected * np.abs(s) / values[:, None],
        atol=1e-5,
    )


@pytest.mark.parametrize(("model", "s"), CASES)
def test_eq_6_the_rate_of_each_sigma2_as_both_change(model: Model, s: FloatArray) -> None:
    v_dot = np.array([0.02, 0.05, -0.03])
    s_dot = 0.1 * s * np.cos(np.arange(s.size))
    h = 1e-5
    ends = [spectrum(model.Omega(s + k * s_dot, V + k * v_dot)).sigma2 for k in (-h, h)]
    found = spectrum(model.Omega(s, V))
    rate = sigma2_jacobian(found, structure_by_v(model, s)) @ v_dot
    rate += sigma2_jacobian(found, structure_by_s(model, s, V)) @ s_dot
    along = (structure_along(model, s, s_dot) @ V)[:, :, None]
    rate_along = sigma2_jacobian(found, structure_by_v(model, s)) @ v_dot
    rate_along += sigma2_jacobian(found, along)[:, 0]
    np.testing.assert_allclose(rate, (ends[1] - ends[0]) / (2 * h), rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(rate_along, rate, rtol=1e-8, atol=1e-15)


def test_with_one_unknown_they_are_the_closed_forms_of_the_paper() -> None:
    v, model = np.array([0.01, 0.05, -0.02]), Cylinder()
    s = np.concatenate(([0.5, -1.0, 9.0], AXIS))
    found = spectrum(model.Omega(s, v))
    B, Omega_s = structure_by_v(model, s), structure_by_s(model, s, v)
    np.testing.assert_allclose(sigma2_jacobian(found, B), [J_v(v, AXIS)], atol=1e-15)
    # (22) is about axes that stay of unit length, so only what is across a is compared.
    across = np.eye(3) - np.outer(AXIS, AXIS)
    np.testing.assert_allclose(
        sigma2_jacobian(found, Omega_s)[0, 3:] @ across, J_a(v, AXIS) @ across, atol=1e-15
    )
    np.testing.assert_allclose(sigma2_jacobian(found, Omega_s)[0, :3], 0.0, atol=1e-15)
    least, gradient = least_sigma2(found, B)
    assert least == pytest.approx(found.sigma2[0], rel=1e-14)
    np.testing.assert_allclose(gradient, J_v(v, AXIS), atol=1e-15)


def test_the_gradient_of_a_point_is_that_of_its_closed_form() -> None:
    (x, y), v = PLANAR_S[:2], V
    a, b = x * v[2] - v[0], y * v[2] - v[1]
    found = spectrum(Points().Omega(PLANAR_S[:2], v))
    by_v = sigma2_jacobian(found, structure_by_v(Points(), PLANAR_S[:2]))
    by_s = sigma2_jacobian(found, structure_by_s(Points(), PLANAR_S[:2], v))
    np.testing.assert_allclose(by_v, [[-2 * a, -2 * b, 2 * (x * a + y * b)]], rtol=1e-12)
    np.testing.assert_allclose(by_s, [[2 * v[2] * a, 2 * v[2] * b]], rtol=1e-10)


def test_equal_eigenvalues_share_what_no_choice_of_eigenvectors_changes() -> None:
    """Points in a plane that v does not approach all have the same σ²."""
    v, model = np.array([0.03, 0.04, 0.0]), Points(3)
    B = structure_by_v(model, PLANAR_S)
    found = spectrum(B @ v)
    np.testing.assert_allclose(found.sigma2, 0.0025, rtol=1e-12)
    trace = [
        (np.trace((B @ (v + e)) @ (B @ (v + e)).T) - np.trace((B @ (v - e)) @ (B @ (v - e)).T))
        / (2e-6)
        for e in 1e-6 * np.eye(3)
    ]
    J = sigma2_jacobian(found, B)
    np.testing.assert_allclose(J, np.tile(np.array(trace) / 3.0, (3, 1)), atol=1e-10)
    # Rotated unknowns have other eigenvectors and the same gradients.
    turned, _ = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))
    rotated = np.einsum("qp,pmk->qmk", turned, B)
    np.testing.assert_allclose(sigma2_jacobian(spectrum(rotated @ v), rotated), J, atol=1e-12)
    np.testing.assert_allclose(
        least_sigma2(spectrum(rotated @ v), rotated)[1], least_sigma2(found, B)[1], atol=1e-12
    )


@pytest.mark.parametrize(("model", "s"), CASES)
def test_the_smooth_least_is_near_the_least_and_has_the_gradient_it_says(
    model: Model, s: FloatArray
) -> None:
    B = structure_by_v(model, s)
    value, gradient = least_sigma2(spectrum(B @ V), B)
    least = spectrum(B @ V).sigma2[0]
    assert least * (1.0 - 1e-12) <= value <= least * model.p ** (1.0 / 16.0) * (1.0 + 1e-12)
    h = 1e-6
    slopes_of_it = [
        (least_sigma2(spectrum(B @ (V + e)), B)[0] - least_sigma2(spectrum(B @ (V - e)), B)[0])
        / (2 * h)
        for e in h * np.eye(3)
    ]
    scale = value / np.linalg.norm(V)
    np.testing.assert_allclose(gradient / scale, np.array(slopes_of_it) / scale, atol=1e-5)


def test_where_nothing_is_told_the_gradient_is_zero_and_no_error() -> None:
    B = structure_by_v(Points(3), PLANAR_S)
    towards = np.array([PLANAR_S[0], PLANAR_S[1], 1.0])
    for v in (np.zeros(3), 0.05 * towards):  # at rest; straight at the first point
        value, gradient = least_sigma2(spectrum(B @ v), B)
        assert value == pytest.approx(0.0, abs=1e-18)
        np.testing.assert_allclose(gradient, 0.0, atol=1e-9)


def test_fewer_measurements_than_unknowns_are_refused() -> None:
    with pytest.raises(ValueError, match="m >= p"):
        spectrum(np.ones((3, 2)))
