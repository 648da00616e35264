"""Points in the plane and on the sphere: rates as exact projection has them, and their σ_i²."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.flow import integrate
from estimator.image.feature import Feature
from estimator.models.bearings import Bearings
from estimator.models.points import Points
from tests.estimator.exact_points import THREE, points_at, seen_points, truth
from tests.estimator.models.test_models import UNIT_TWISTS, moved
from tests.estimator.responses import EXACT, MOTION

FloatArray = NDArray[np.float64]
Model = Points | Bearings

BOTH = [pytest.param(Points(3), id="planar"), pytest.param(Bearings(3), id="spherical")]
STEP = 1e-5


@pytest.mark.parametrize("u", UNIT_TWISTS)
@pytest.mark.parametrize("model", BOTH)
def test_points_and_their_depths_change_as_projection_says(model: Model, u: FloatArray) -> None:
    s, chi = truth(model, THREE)
    before, after = (
        truth(model, np.array([moved(point, u, h) for point in THREE])) for h in (-STEP, STEP)
    )
    rate = model.f_m(s, u) + model.Omega(s, u[:3]).T @ chi
    np.testing.assert_allclose(rate, (after[0] - before[0]) / (2 * STEP), atol=1e-7)
    np.testing.assert_allclose(model.f_u(s, chi, u), (after[1] - before[1]) / (2 * STEP), atol=1e-7)


@pytest.mark.parametrize("model", BOTH)
def test_integrated_along_a_motion_they_arrive_where_they_are_seen(model: Model) -> None:
    window = EXACT.window(0.0, 2.0)
    s0, chi0 = truth(model, points_at(MOTION, THREE, 0.0))
    s, chi = integrate(model, s0[None], chi0[None], window.times_s, window.twists_camera)
    s_end, chi_end = truth(model, points_at(MOTION, THREE, 2.0))
    np.testing.assert_allclose(s[0, -1], s_end, atol=2e-6)
    np.testing.assert_allclose(chi[0, -1], chi_end, rtol=2e-6)


@pytest.mark.parametrize("model", BOTH)
def test_both_read_the_same_image_and_find_the_same_points(model: Model) -> None:
    feature = seen_points(THREE)
    s, chi = truth(model, THREE)
    np.testing.assert_allclose(model.measured(feature, None), s, atol=1e-15)
    np.testing.assert_allclose(model.shown(s), feature.s, atol=1e-15)
    position, axis = model.position_and_axis(s)
    assert axis is None
    np.testing.assert_allclose(position / model.inverse_radius(s, chi), THREE[0], rtol=1e-12)
    np.testing.assert_allclose(model.chi_of_guess(s, 0.4), np.full(3, 2.5))


@pytest.mark.parametrize("v", [(0.03, -0.04, 0.05), (0.05, 0.01, 0.0), (0.0, 0.0, 0.05)])
def test_how_fast_a_depth_shows_depends_on_the_parametrisation(v: tuple[float, ...]) -> None:
    """In the plane, where the point is seen counts; on the sphere only the angle to v does."""
    velocity = np.array(v)
    planar, spherical = Points(3), Bearings(3)
    rows = planar.Omega(truth(planar, THREE)[0], velocity)
    P = THREE / THREE[:, 2:]
    expected = ((P[:, :2] * v[2] - velocity[:2]) ** 2).sum(axis=1)
    np.testing.assert_allclose(rows @ rows.T, np.diag(expected), atol=1e-16)
    rows = spherical.Omega(truth(spherical, THREE)[0], velocity)
    P = THREE / np.linalg.norm(THREE, axis=1, keepdims=True)
    expected = velocity @ velocity - (P @ velocity) ** 2
    np.testing.assert_allclose(rows @ rows.T, np.diag(expected), atol=1e-16)


@pytest.mark.parametrize("point", THREE)
def test_the_largest_sigma2_is_that_of_a_motion_across_the_ray(point: FloatArray) -> None:
    P = point / point[2]
    # Away from the middle of the image, within the plane of ray and optical axis, across the ray.
    across = np.array([P[0], P[1], -(P[0] ** 2 + P[1] ** 2)])
    across /= np.linalg.norm(across)
    for model, largest in ((Points(), float(P @ P)), (Bearings(), 1.0)):
        s, _ = truth(model, point[None])
        at_best = float((model.Omega(s, across) ** 2).sum())
        assert at_best == pytest.approx(largest, rel=1e-12)
        directions = np.random.default_rng(1).standard_normal((200, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        others = [float((model.Omega(s, d) ** 2).sum()) for d in directions]
        assert max(others) <= at_best * (1.0 + 1e-12)


@pytest.mark.parametrize("model", BOTH)
def test_an_image_with_other_points_is_refused(model: Model) -> None:
    with pytest.raises(ValueError, match="3 points holds 6"):
        model.measured(Feature(np.zeros(4), np.eye(4)), None)
    with pytest.raises(ValueError, match="no axis"):
        model.measured(Feature(np.zeros(6), np.eye(6), np.array([1.0, 0.0, 0.0])), None)
    with pytest.raises(ValueError, match="one point or more"):
        type(model)(0)
