"""The refinement finds the outline to a hundredth of a pixel and knows how well it did."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from estimator.image.intrinsics import Intrinsics
from estimator.image.limb_fit import LimbFit, refine_cylinder, refine_sphere
from tests.estimator.image.exact_images import (
    DEFAULT_INTRINSICS,
    Look,
    Sample,
    blocks,
    cylinder_s,
    hard_look,
    render,
    sequence,
)


def refined(
    sample: Sample, rng: np.random.Generator, wrong_px: float = 0.4, lens: Intrinsics | None = None
) -> LimbFit:
    """The fit from a guess whose outline is wrong by up to about ``wrong_px``."""
    lens = DEFAULT_INTRINSICS if lens is None else lens
    s, length = sample.s, float(np.linalg.norm(sample.s))
    s0 = s + wrong_px * rng.uniform(-1.0, 1.0, 3) * [s[2] / 800.0, s[2] / 800.0, length / 80.0]
    if sample.axis is None:
        fit = refine_sphere(sample.image, lens, s0)
    else:
        axis0 = sample.axis + rng.normal(0.0, wrong_px / 1000.0, 3)
        fit = refine_cylinder(sample.image, lens, s0, axis0)
    assert fit is not None
    return fit


def from_truth(sample: Sample, learnt: np.ndarray | None = None) -> LimbFit:
    """The fit from the true outline."""
    if sample.axis is None:
        fit = refine_sphere(sample.image, DEFAULT_INTRINSICS, sample.s, learnt)
    else:
        fit = refine_cylinder(sample.image, DEFAULT_INTRINSICS, sample.s, sample.axis, learnt)
    assert fit is not None
    return fit


def errors(samples: list[Sample], **how: object) -> tuple[np.ndarray, np.ndarray]:
    """Relative errors of |s|, and their squares over the variance the fit claims."""
    rng = np.random.default_rng(7)
    relative, normalised = [], []
    for sample in samples:
        fit = refined(sample, rng, **how)  # type: ignore[arg-type]
        length = float(np.linalg.norm(sample.s))
        towards = sample.s / length
        relative.append(float(np.linalg.norm(fit.s)) / length - 1.0)
        normalised.append((relative[-1] * length) ** 2 / float(towards @ fit.covariance @ towards))
    return np.array(relative), np.array(normalised)


@pytest.mark.parametrize(
    ("target", "kind", "most_rms"),
    [
        ("sphere", "clean", 1.5e-5),
        ("cylinder", "clean", 1.5e-5),
        ("sphere", "hard", 3.5e-4),
        ("cylinder", "hard", 3.5e-4),
    ],
)
def test_accuracy_and_honesty(target: str, kind: str, most_rms: float) -> None:
    samples = [s for seed in (11, 12) for s in sequence(target, kind, seed, 10)]
    relative, normalised = errors(samples)
    assert np.sqrt(np.mean(relative**2)) < most_rms
    assert 0.2 < np.mean(normalised) < 4.0


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_a_guess_two_pixels_off_ends_where_a_good_one_does(target: str) -> None:
    samples = list(sequence(target, "clean", 3, 5))
    relative, _ = errors(samples, wrong_px=1.8)
    assert np.max(np.abs(relative)) < 6e-5


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_a_strong_lens_costs_no_accuracy(target: str) -> None:
    lens = Intrinsics(800.0, 800.0, 319.5, 239.5, np.array([-0.3, 0.08, 1e-3, -1e-3, 0.0]))
    relative, _ = errors(list(sequence(target, "clean", 5, 5, intrinsics=lens)), lens=lens)
    assert np.sqrt(np.mean(relative**2)) < 2.5e-5


def test_a_dark_target_is_measured_as_well() -> None:
    look = Look(foreground=30.0, background=200.0)
    relative, _ = errors(list(sequence("sphere", "clean", 6, 6, look)))
    assert np.sqrt(np.mean(relative**2)) < 2.5e-5


@pytest.mark.parametrize("radius_px", [25.0, 120.0, 200.0])
def test_small_and_large_spheres(radius_px: float) -> None:
    rng = np.random.default_rng(8)
    s = np.array([0.1, -0.05, 1.0]) * np.sqrt(1.0 + (800.0 / radius_px) ** 2)
    samples = [Sample(render(s, None, Look(), rng), s) for _ in range(4)]
    relative, _ = errors(samples)
    assert np.sqrt(np.mean(relative**2)) < 2e-5 * (61.0 / radius_px) ** 1.5 + 5e-6


def test_an_image_without_noise_breaks_nothing() -> None:
    look = Look(noise_grey=0.0)
    relative, _ = errors(list(sequence("sphere", "clean", 9, 3, look)))
    assert np.max(np.abs(relative)) < 2e-5


def test_blur_is_found_without_being_told() -> None:
    look = replace(Look(), blur_px=(2.4, -1.8))
    rng = np.random.default_rng(10)
    fit = refined(next(sequence("sphere", "clean", 10, 1, look)), rng)
    assert fit.blur_px == pytest.approx(3.0, abs=0.15)
    assert fit.noise_grey == pytest.approx(2.0, abs=0.2)
    assert fit.chi2 == pytest.approx(1.0, abs=0.3)
    assert fit.usable_fraction == 1.0
    assert fit.converged


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
@pytest.mark.parametrize(
    ("before", "now"), [("hard", "hard"), ("clean", "hard"), ("hard", "clean")]
)
def test_what_another_image_taught_is_no_more_than_a_start(
    target: str, before: str, now: str
) -> None:
    other = from_truth(next(sequence(target, before, 17, 1)))
    sample = next(sequence(target, now, 18, 1))
    alone, taught = from_truth(sample), from_truth(sample, other.learnt)
    towards = alone.s / np.linalg.norm(alone.s)
    std = np.sqrt(towards @ alone.covariance @ towards)
    assert abs(towards @ (taught.s - alone.s)) < 0.5 * std
    assert taught.converged


def test_covered_sectors_are_told_from_good_ones() -> None:
    rng = np.random.default_rng(13)
    sample = next(sequence("sphere", "clean", 13, 1))
    image = sample.image.copy()
    u, _ = DEFAULT_INTRINSICS.project(sample.s[None])[0]
    image[:, int(u) + 25 :] = 90
    fit = refined(Sample(image, sample.s), rng)
    radius_px = 800.0 / np.sqrt(float(sample.s @ sample.s) - 1.0)
    around = 2.0 * np.pi * (np.arange(len(fit.usable)) + 0.5) / len(fit.usable) - np.pi
    to_the_right_px = radius_px * np.cos(around)
    assert not fit.usable[to_the_right_px > 33.0].any()
    assert fit.usable[to_the_right_px < 15.0].mean() > 0.8
    assert fit.usable_fraction < 0.8


def test_a_square_is_not_taken_for_a_sphere() -> None:
    image = np.full((480, 640), 20, dtype=np.uint8)
    cv2.rectangle(image, (260, 180), (379, 299), 220, -1)
    fit = refine_sphere(image, DEFAULT_INTRINSICS, np.array([0.0, 0.0, 800.0 / 64.0]))
    assert fit is None or fit.usable_fraction < 0.5


@pytest.mark.parametrize("sigma_px", [0.5, 0.8])
@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_a_lens_that_blurs_does_not_pull_the_outline_in(target: str, sigma_px: float) -> None:
    samples = list(sequence(target, "clean", 5, 8, Look(psf_sigma_px=sigma_px)))
    relative, normalised = errors(samples)
    assert abs(relative.mean()) < 1.5e-5
    assert normalised.mean() < 2.0


@pytest.mark.parametrize("look", [Look(258.0, noise_grey=3.0), Look(220.0, 0.0, noise_grey=4.0)])
@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_light_beyond_what_the_camera_shows_makes_the_outline_less_certain(
    target: str, look: Look
) -> None:
    relative, normalised = errors(list(sequence(target, "clean", 5, 8, look)))
    assert np.abs(relative).max() < 3e-4
    assert normalised.mean() < 2.0


def test_what_lies_outside_the_image_is_said() -> None:
    rng = np.random.default_rng(14)
    s = np.array([-5.0, 0.0, 13.0])
    fit = refined(Sample(render(s, None, Look(), rng), s), rng)
    assert fit.in_view.mean() < 0.7
    assert float(np.linalg.norm(fit.s)) == pytest.approx(float(np.linalg.norm(s)), rel=3e-4)


def test_edgy_clutter_is_survived() -> None:
    rng = np.random.default_rng(15)
    looks = [replace(hard_look(rng), background=blocks(rng)) for _ in range(6)]
    samples = [next(sequence("sphere", "hard", 20 + i, 1, look)) for i, look in enumerate(looks)]
    relative, _ = errors(samples)
    assert np.max(np.abs(relative)) < 2e-3


@pytest.mark.parametrize("s0", [[0.0, 0.0, 0.5], [0.0, 0.0, -9.0], [60.0, 0.0, 12.0], [np.nan] * 3])
def test_nothing_to_fit_is_none(s0: list[float]) -> None:
    image = np.full((480, 640), 20, dtype=np.uint8)
    assert refine_sphere(image, DEFAULT_INTRINSICS, np.array(s0)) is None


def test_the_axis_keeps_its_sign_and_its_right_angle() -> None:
    rng = np.random.default_rng(16)
    sample = next(sequence("cylinder", "clean", 16, 1))
    assert sample.axis is not None
    for sign in (1.0, -1.0):
        fit = refined(Sample(sample.image, sample.s, sign * sample.axis), rng)
        assert fit.axis is not None
        assert float(fit.axis @ sample.axis) * sign > 0.999999
        assert np.linalg.norm(cylinder_s(fit.s, fit.axis) - fit.s) < 1e-9
