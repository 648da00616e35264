"""The moments path: (9)-(11) with (10) corrected, against exact ellipses and exact images."""

import numpy as np
import pytest

from estimator.image.feature import Feature
from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.image.moments import BlobMoments, MomentsMeter, expected_second, s_of_moments
from estimator.image.outline import outline_px
from tests.estimator.image.exact_images import DEFAULT_INTRINSICS, Look, render

UNIT = Intrinsics(1.0, 1.0, 0.0, 0.0)
POSITIONS = [np.array([0.0, 0.0, 5.0]), np.array([1.5, -2.0, 9.0]), np.array([4.0, 3.0, 14.0])]


def polygon_moments(s: FloatArray) -> BlobMoments:
    """Exact moments of the outline's polygon (Green's theorem), which is nearly the ellipse."""
    points = outline_px(Feature(s, np.eye(3)), UNIT, (1, 1))[0]
    x, y = points[:-1].T
    x2, y2 = points[1:].T
    cross = x * y2 - x2 * y
    area = cross.sum() / 2.0
    centre = np.array([((x + x2) * cross).sum(), ((y + y2) * cross).sum()]) / (6.0 * area)
    n20 = ((x * x + x * x2 + x2 * x2) * cross).sum() / (12.0 * area) - centre[0] ** 2
    n02 = ((y * y + y * y2 + y2 * y2) * cross).sum() / (12.0 * area) - centre[1] ** 2
    n11 = ((x * y2 + 2 * x * y + 2 * x2 * y2 + x2 * y) * cross).sum() / (24.0 * area)
    n11 -= centre[0] * centre[1]
    return BlobMoments(abs(area), centre, np.array([[n20, n11], [n11, n02]]))


@pytest.mark.parametrize("s", POSITIONS)
def test_moments_of_the_exact_outline_give_s_back(s: FloatArray) -> None:
    # 180 corners cut (2 pi / 180)^2 / 6 off the second moments.
    assert np.allclose(s_of_moments(polygon_moments(s)), s, rtol=3e-4, atol=1e-9)


@pytest.mark.parametrize("s", POSITIONS)
def test_expected_second_moments_are_those_of_the_exact_outline(s: FloatArray) -> None:
    assert np.allclose(polygon_moments(s).second, expected_second(s), rtol=1e-3, atol=1e-9)


def test_equation_10_is_the_minor_semi_axis_and_its_printed_form_is_not() -> None:
    s = POSITIONS[2]
    n = expected_second(s)
    exact = 1.0 / (s[2] ** 2 - 1.0)  # R^2 / (Z0^2 - R^2)
    root = np.sqrt((n[0, 0] - n[1, 1]) ** 2 + 4.0 * n[0, 1] ** 2)
    assert 2.0 * (n[0, 0] + n[1, 1] - root) == pytest.approx(exact, rel=1e-12)
    printed = 2.0 * (n[0, 0] + n[1, 1] - np.sqrt((n[0, 0] - n[1, 1]) ** 2 + 4.0 * n[0, 1]))
    assert abs(printed / exact - 1.0) > 1.0


def test_clean_images_are_measured_within_the_stated_deviation() -> None:
    rng = np.random.default_rng(1)
    meter = MomentsMeter(DEFAULT_INTRINSICS)
    squares = []
    for _ in range(12):
        s = np.append(rng.uniform(-2.0, 2.0, 2), rng.uniform(11.0, 15.0))
        feature = meter.measure(render(s, None, Look(), rng)).feature
        assert feature is not None
        assert np.linalg.norm(feature.s) == pytest.approx(np.linalg.norm(s), rel=2e-3)
        error = feature.s - s
        squares.append(float(error @ np.linalg.solve(feature.covariance, error)) / 3.0)
    assert 0.2 < np.mean(squares) < 3.0


def test_dark_spheres_on_bright_backgrounds_too() -> None:
    s = np.array([0.5, 0.4, 12.0])
    look = Look(foreground=20.0, background=200.0)
    feature = (
        MomentsMeter(DEFAULT_INTRINSICS)
        .measure(render(s, None, look, np.random.default_rng(2)))
        .feature
    )
    assert feature is not None and np.allclose(feature.s, s, rtol=2e-3, atol=5e-3)


def square(image: np.ndarray) -> None:
    image[200:300, 250:350] = 220


def ellipse(image: np.ndarray) -> None:
    v, u = np.mgrid[:480, :640]
    image[((u - 320) / 80.0) ** 2 + ((v - 240) / 60.0) ** 2 < 1.0] = 220


def cut_off(image: np.ndarray) -> None:
    v, u = np.mgrid[:480, :640]
    image[(u - 20) ** 2 + (v - 240) ** 2 < 60**2] = 220


@pytest.mark.parametrize(
    ("draw", "reason"),
    [
        (square, "not elliptical"),
        (ellipse, "no sphere's outline"),
        (cut_off, "border"),
        (lambda image: None, "stands out"),
    ],
)
def test_other_shapes_are_refused_with_a_reason(draw: object, reason: str) -> None:
    image = np.full((480, 640), 20, np.uint8)
    draw(image)  # type: ignore[operator]
    measurement = MomentsMeter(DEFAULT_INTRINSICS).measure(image)
    assert not measurement.found and reason in measurement.reason
