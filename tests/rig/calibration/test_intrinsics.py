"""Intrinsics from views: exact, with honest deviations, or a message that says what to add."""

from dataclasses import replace

import numpy as np
import pytest

from rig.calibration.errors import CalibrationError
from rig.calibration.intrinsics import IntrinsicsFit, fit_intrinsics
from rig.calibration.lens_model import folds
from rig.calibration.projection import to_vector
from rig.calibration.views import BoardView
from tests.rig.calibration.synthetic import (
    SIZE,
    Truth,
    inside,
    posed_views,
    random_truth,
    tool_poses,
    view,
)


def views_of(truth: Truth, seed: int, count: int = 22, noise_px: float = 0.07) -> list[BoardView]:
    return [one.board for one in posed_views(truth, count, seed, noise_px)]


def deviations(fit: IntrinsicsFit, truth: Truth) -> np.ndarray:
    """Errors in standard deviations, of the coefficients that were fitted."""
    off = to_vector(fit.intrinsics) - to_vector(truth.intrinsics)
    return (off / np.where(fit.std > 0, fit.std, np.inf))[fit.std > 0]


def test_exact_corners_give_exact_intrinsics() -> None:
    truth = random_truth(1)
    fit = fit_intrinsics(views_of(truth, 1, noise_px=1e-4), SIZE)
    off = to_vector(fit.intrinsics) - to_vector(truth.intrinsics)
    assert np.max(np.abs(off[:4])) < 0.01
    assert np.max(np.abs(off[4:8])) < 1e-3


def test_the_truth_lies_within_the_stated_deviations() -> None:
    found = []
    for seed in range(3):
        truth = random_truth(seed)
        fit = fit_intrinsics(views_of(truth, seed), SIZE)
        found.append(deviations(fit, truth)[:4])
        assert fit.rms_px == pytest.approx(0.07 * np.sqrt(2), rel=0.15)
        assert 0.9 < fit.held_out_px / fit.rms_px < 1.25
    scatter = np.concatenate(found)
    assert np.mean(np.abs(scatter) < 3.0) >= 0.97
    assert 0.5 < np.sqrt(np.mean(scatter**2)) < 1.5


def test_a_distorted_lens_is_not_taken_for_a_pinhole() -> None:
    truth = random_truth(2)
    fit = fit_intrinsics(views_of(truth, 2), SIZE)
    by_name = {one.model.name: one.rms_px for one in fit.held_out}
    assert by_name["pinhole"] > 1.3 * fit.held_out_px
    assert sum(fit.model.coefficients) >= 2


def test_a_spoilt_view_is_left_out_and_named() -> None:
    truth = random_truth(3)
    views = views_of(truth, 3)
    bent = views[7].pixels + 1.5 * np.sin(views[7].pixels / 40.0)
    views[7] = replace(views[7], pixels=bent)
    fit = fit_intrinsics(views, SIZE)
    assert list(fit.rejected_views) == [7]
    assert "median" in fit.rejected_views[7]
    assert np.max(np.abs(deviations(fit, truth)[:4])) < 4.0


def test_single_bad_corners_are_left_out_but_their_view_stays() -> None:
    truth = random_truth(4)
    views = views_of(truth, 4)
    for i in (2, 9):
        pixels = views[i].pixels.copy()
        pixels[3] += [2.0, -1.0]
        views[i] = replace(views[i], pixels=pixels)
    fit = fit_intrinsics(views, SIZE)
    assert fit.rejected_views == {}
    assert 2 <= fit.rejected_corners <= 4  # the two, and what they had spoilt
    assert np.max(np.abs(deviations(fit, truth)[:4])) < 4.0


def test_too_few_views_ask_for_more() -> None:
    with pytest.raises(CalibrationError, match=r"5 usable views .* at least 8 .* add 3"):
        fit_intrinsics(views_of(random_truth(5), 5, count=5), SIZE)


def test_a_view_with_hardly_any_corners_is_named() -> None:
    views = views_of(random_truth(5), 5, count=9)
    views[4] = views[4].only(np.arange(len(views[4])) < 4)
    with pytest.raises(CalibrationError, match="view 4 shows 4 corners"):
        fit_intrinsics(views, SIZE)


def test_frontal_views_are_refused_with_the_tilt_that_is_missing() -> None:
    truth, rng = random_truth(6), np.random.default_rng(6)
    poses = [truth.tool_looking(d, 0.04, 0.5 * d, d) for d in np.linspace(0.28, 0.45, 12)]
    views = [view(truth, T, rng) for T in poses]
    with pytest.raises(CalibrationError, match=r"tilt"):
        fit_intrinsics(views, SIZE)


def test_corners_in_one_part_of_the_image_are_refused() -> None:
    truth, rng = random_truth(7), np.random.default_rng(7)
    views = []
    for T in tool_poses(truth, 60, 7):
        pixels = truth.pixels(T)
        kept = inside(pixels) & (pixels[:, 0] < 300) & (pixels[:, 1] < 260)
        if kept.sum() >= 8:
            ids = np.flatnonzero(kept)
            noisy = pixels[kept] + 0.05 * rng.standard_normal((len(ids), 2))
            views.append(BoardView(ids, truth.points_m[kept], noisy))
    assert len(views) >= 10
    with pytest.raises(CalibrationError, match=r"cover|known to"):
        fit_intrinsics(views, SIZE)


def test_views_of_different_boards_are_refused() -> None:
    truth, rng = random_truth(8), np.random.default_rng(8)
    views = [
        replace(one, points_m=one.points_m * [1.0, rng.uniform(0.7, 1.3), 1.0])
        for one in views_of(truth, 8)
    ]
    with pytest.raises(CalibrationError):
        fit_intrinsics(views, SIZE)


def test_a_distortion_that_folds_the_image_is_recognised() -> None:
    pinhole = np.array([800.0, 800.0, 320.0, 240.0, 0, 0, 0, 0, 0])
    assert not folds(pinhole, SIZE)
    strong = pinhole + np.array([0, 0, 0, 0, -1.6, 0, 0, 0, 0])
    assert folds(strong, SIZE)
