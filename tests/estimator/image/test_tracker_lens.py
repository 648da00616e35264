"""Every stage through a strongly distorting lens, off-centre and with unequal focal lengths."""

import numpy as np
import pytest

from estimator.image.feature import Feature
from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.image.tracker import TargetTracker
from tests.estimator.image.exact_images import Look, cylinder_s, render

LENS = Intrinsics(790.0, 810.0, 310.0, 250.0, np.array([-0.28, 0.09, 1e-3, -5e-4, 0.0]))
SPHERE = np.array([3.1, 2.0, 11.5])
AXIS = np.array([0.6, 0.75, 0.28]) / np.linalg.norm([0.6, 0.75, 0.28])
CYLINDER = cylinder_s(np.array([1.5, -1.0, 9.0]), AXIS)


def deviations(feature: Feature, s: FloatArray) -> float:
    error = feature.s - s
    return float(np.sqrt(error @ np.linalg.pinv(feature.covariance, rcond=1e-9) @ error))


def test_sphere_and_cylinder_are_measured_in_the_corner_of_the_image() -> None:
    rng = np.random.default_rng(1)
    image = render(SPHERE, None, Look(), rng, LENS)
    feature = TargetTracker("sphere", LENS).measure(image).feature
    assert feature is not None and deviations(feature, SPHERE) < 4.5
    assert np.linalg.norm(feature.s) == pytest.approx(np.linalg.norm(SPHERE), rel=1e-4)

    by_moments = TargetTracker("sphere", LENS, "moments").measure(image).feature
    assert by_moments is not None and deviations(by_moments, SPHERE) < 4.5

    image = render(CYLINDER, AXIS, Look(), rng, LENS)
    feature = TargetTracker("cylinder", LENS).measure(image).feature
    assert feature is not None and feature.axis is not None
    assert deviations(feature, CYLINDER) < 4.5
    assert np.linalg.norm(feature.s) == pytest.approx(np.linalg.norm(CYLINDER), rel=1e-4)
    assert abs(feature.axis @ AXIS) > 1.0 - 1e-6

    # The same picture taken for an undistorted one is no cylinder: its sides are bent.
    pinhole = Intrinsics(790.0, 810.0, 310.0, 250.0)
    assert not TargetTracker("cylinder", pinhole).measure(image).found
