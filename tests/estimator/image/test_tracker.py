"""The tracker: exact sequences without a lost frame, and no number from a picture that has none."""

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.image.feature import Feature
from estimator.image.intrinsics import FloatArray
from estimator.image.tracker import TargetTracker, warm_up
from tests.estimator.image.exact_images import (
    DEFAULT_INTRINSICS,
    Look,
    blocks,
    cylinder_s,
    hard_look,
    render,
    sequence,
    texture,
)

GreyImage = NDArray[np.uint8]
SPHERE = np.array([0.4, -0.3, 12.8])
TILTED = np.array([0.35, 0.9, 0.26]) / np.linalg.norm([0.35, 0.9, 0.26])
CYLINDER = cylinder_s(np.array([0.3, 0.2, 9.5]), TILTED)


def tracker(target: str, method: str = "limb") -> TargetTracker:
    return TargetTracker(target, DEFAULT_INTRINSICS, method)  # type: ignore[arg-type]


def size_error(feature: Feature, s: FloatArray) -> float:
    return float(np.linalg.norm(feature.s) / np.linalg.norm(s) - 1.0)


def deviations(feature: Feature, s: FloatArray) -> float:
    error = feature.s - s
    return float(np.sqrt(error @ np.linalg.pinv(feature.covariance, rcond=1e-9) @ error))


@pytest.mark.parametrize(
    ("target", "kind", "rms", "seed"),
    [
        ("sphere", "clean", 3e-5, 11),
        ("cylinder", "clean", 3e-5, 12),
        ("sphere", "hard", 8e-4, 13),
        ("cylinder", "hard", 8e-4, 14),
    ],
)
def test_sequences_are_tracked_without_a_lost_frame(
    target: str, kind: str, rms: float, seed: int
) -> None:
    t = tracker(target)
    errors = []
    axis = None
    for sample in sequence(target, kind, seed, frames=25):
        feature = t.measure(sample.image).feature
        assert feature is not None
        errors.append(size_error(feature, sample.s))
        if feature.axis is not None:
            assert axis is None or feature.axis @ axis > 0.0
            axis = feature.axis
    assert np.sqrt(np.mean(np.square(errors))) < rms


def test_a_prediction_is_used_and_its_type_does_not_matter() -> None:
    image = render(SPHERE, None, Look(), np.random.default_rng(1))
    near = Feature(np.asarray([0.45, -0.25, 12.9], dtype=np.float32), np.eye(3))
    feature = tracker("sphere").measure(image, near).feature
    assert feature is not None and abs(size_error(feature, SPHERE)) < 1e-4


def test_of_two_spheres_the_predicted_one_is_measured() -> None:
    rng = np.random.default_rng(2)
    left, right = np.array([-2.5, 0.0, 14.0]), np.array([2.5, 0.3, 11.0])
    image = np.maximum(render(left, None, Look(), rng), render(right, None, Look(), rng))
    for s in (left, right):
        expected = Feature(s + np.array([0.05, 0.05, 0.1]), np.eye(3))
        feature = tracker("sphere").measure(image, expected).feature
        assert feature is not None and abs(size_error(feature, s)) < 1e-4


def test_of_two_parallel_pipes_one_is_measured_and_never_a_mixture() -> None:
    rng = np.random.default_rng(3)
    axis = np.array([0.0, 1.0, 0.0])
    pipes = [np.array([-2.4, 0.0, 12.0]), np.array([2.2, 0.0, 13.0])]
    image = np.maximum(*(render(s, axis, Look(), rng) for s in pipes))
    feature = tracker("cylinder").measure(image).feature
    assert feature is not None
    # Sides exactly along the pixel grid are the least favourable: few pixels show the edge.
    assert min(deviations(feature, s) for s in pipes) < 4.0
    assert min(abs(size_error(feature, s)) for s in pipes) < 2e-3


def test_a_lost_target_is_taken_up_again_but_not_another_one() -> None:
    rng = np.random.default_rng(4)
    t = tracker("sphere")
    assert t.measure(render(SPHERE, None, Look(), rng)).found
    assert not t.measure(np.full((480, 640), 20, np.uint8)).found
    other = np.array([2.0, 1.0, 8.0])
    assert not t.measure(render(other, None, Look(), rng)).found
    moved = SPHERE + np.array([0.5, 0.3, 0.2])
    feature = t.measure(render(moved, None, Look(), rng)).feature
    assert feature is not None and abs(size_error(feature, moved)) < 1e-4
    t.reset()
    assert t.measure(render(other, None, Look(), rng)).found


def test_dark_targets_on_bright_backgrounds_are_measured() -> None:
    rng = np.random.default_rng(5)
    look = Look(foreground=25.0, background=190.0)
    feature = tracker("sphere").measure(render(SPHERE, None, look, rng)).feature
    assert feature is not None and abs(size_error(feature, SPHERE)) < 1e-4
    feature = tracker("cylinder").measure(render(CYLINDER, TILTED, look, rng)).feature
    assert feature is not None and abs(size_error(feature, CYLINDER)) < 1e-4


@pytest.mark.parametrize("corner", [(-1, 0), (1, 0), (0, -1), (0, 1)])
def test_a_sphere_that_leaves_the_image_is_no_feature(corner: tuple[int, int]) -> None:
    rng = np.random.default_rng(6)
    t = tracker("sphere")
    for out_px in (-30, -20, -10, -5, 0, 5, 10, 20, 40):
        # The outline's far side is out_px beyond the border; its radius is 62.7 px.
        u = corner[0] * (319.5 - 62.7 * 1.07 + out_px) / 800.0
        v = corner[1] * (239.5 - 62.7 * 1.04 + out_px) / 800.0
        s = 12.8 * np.array([u, v, 1.0])
        measurement = t.measure(render(s, None, Look(), rng))
        if measurement.feature is not None:
            assert out_px < 5 and abs(size_error(measurement.feature, s)) < 1e-4
        else:
            assert out_px > -10 and measurement.reason


def covered(image: GreyImage, share: float, grey: int) -> GreyImage:
    """Everything left of ``share`` of the sphere's diameter painted over."""
    centre_px = DEFAULT_INTRINSICS.project(SPHERE[None])[0]
    image = image.copy()
    image[:, : int(centre_px[0] - 62.7 + 2 * 62.7 * share)] = grey
    return image


@pytest.mark.parametrize("grey", [0, 60, 255])
def test_an_occluder_costs_the_measurement_before_it_costs_its_truth(grey: int) -> None:
    image = render(SPHERE, None, Look(), np.random.default_rng(7))
    for share in (0.01, 0.03, 0.06, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9):
        expected = Feature(SPHERE * 1.002, np.eye(3))
        feature = tracker("sphere").measure(covered(image, share, grey), expected).feature
        if feature is not None:
            assert share < 0.2 and deviations(feature, SPHERE) < 6.0
        if share >= 0.35:
            assert feature is None


def shape_image(draw: Callable[[GreyImage], object], seed: int = 1) -> GreyImage:
    """A drawing, four times as large, reduced and given noise on a dark background."""
    large = np.zeros((1920, 2560), np.uint8)
    draw(large)
    share = cv2.resize(large, (640, 480), interpolation=cv2.INTER_AREA) / 255.0
    noise = 2.0 * np.random.default_rng(seed).standard_normal(share.shape)
    image: GreyImage = np.clip(np.rint(25.0 + 190.0 * share + noise), 0, 255).astype(np.uint8)
    return image


def polygon(corners: int, radius: int = 320) -> Callable[[GreyImage], object]:
    angle = 0.3 + 2.0 * np.pi * np.arange(corners) / corners
    points = np.stack([1200 + radius * np.cos(angle), 900 + radius * np.sin(angle)], axis=1)
    return lambda image: cv2.fillPoly(image, [np.rint(points).astype(np.int32)], 255)


def ellipse(ratio: float) -> Callable[[GreyImage], object]:
    axes = (300, round(300 * ratio))
    return lambda image: cv2.ellipse(image, (1300, 950), axes, 25.0, 0.0, 360.0, 255, -1)


def half_moon(image: GreyImage) -> None:
    cv2.ellipse(image, (1300, 950), (300, 300), 20.0, -90.0, 90.0, 255, -1)


def checkerboard(image: GreyImage) -> None:
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    image[(u // 160 + v // 160) % 2 == 0] = 255


def ring(image: GreyImage) -> None:
    cv2.circle(image, (1300, 950), 300, 255, 16)


def bent_pipe(image: GreyImage) -> None:
    cv2.circle(image, (1300, 5200), 4300, 255, 400)


def wedge(image: GreyImage) -> None:
    cv2.fillPoly(image, [np.array([[300, 300], [2600, 700], [2600, 1600]], np.int32)], 255)


def one_edge(image: GreyImage) -> None:
    image[:, 1300:] = 255


NO_SPHERES = {
    "triangle": polygon(3), "square": polygon(4), "hexagon": polygon(6), "octagon": polygon(8),
    "12 corners": polygon(12), "ellipse 0.9": ellipse(0.9), "ellipse 0.97": ellipse(0.97),
    "half moon": half_moon, "checkerboard": checkerboard, "ring": ring, "bent pipe": bent_pipe,
    "one edge": one_edge, "nothing": lambda image: None,
}  # fmt: skip
NO_CYLINDERS = {
    "triangle": polygon(3), "square": polygon(4), "disc": ellipse(1.0), "wedge": wedge,
    "checkerboard": checkerboard, "ring": ring, "bent pipe": bent_pipe, "one edge": one_edge,
    "nothing": lambda image: None,
}  # fmt: skip


@pytest.mark.parametrize("shape", NO_SPHERES)
def test_other_shapes_are_no_spheres(shape: str) -> None:
    for image in (shape_image(NO_SPHERES[shape]), 255 - shape_image(NO_SPHERES[shape])):
        measurement = tracker("sphere").measure(image)
        assert not measurement.found and measurement.reason


@pytest.mark.parametrize("shape", NO_CYLINDERS)
def test_other_shapes_are_no_cylinders(shape: str) -> None:
    for image in (shape_image(NO_CYLINDERS[shape]), 255 - shape_image(NO_CYLINDERS[shape])):
        measurement = tracker("cylinder").measure(image)
        assert not measurement.found and measurement.reason


@pytest.mark.parametrize("target", ["sphere", "cylinder"])
def test_backgrounds_alone_contain_no_target(target: str) -> None:
    rng = np.random.default_rng(8)
    scenes = [np.full((480, 640), 255.0), np.zeros((480, 640)), blocks(rng), blocks(rng, 60)]
    scenes += [texture(rng, c, high=h) for c in (0.0, 1.0, 3.0, 8.0, 20.0) for h in (110.0, 250.0)]
    t = tracker(target)
    for scene in scenes:
        noisy = scene + 4.0 * rng.standard_normal(scene.shape)
        image = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
        t.reset()
        assert not t.measure(image).found


def test_a_target_among_clutter_and_other_shapes_is_the_one_measured() -> None:
    rng = np.random.default_rng(9)
    for _ in range(4):
        look = replace(hard_look(rng), background=blocks(rng, 150))
        image = render(SPHERE, None, look, rng)
        cv2.rectangle(image, (30, 40), (150, 130), 235, -1)
        cv2.ellipse(image, (540, 380), (80, 45), 30.0, 0.0, 360.0, 240, -1)
        cv2.line(image, (0, 470), (639, 400), 220, 5)
        feature = tracker("sphere").measure(image).feature
        assert feature is not None and abs(size_error(feature, SPHERE)) < 5e-3


def test_equal_images_give_equal_results() -> None:
    image = render(SPHERE, None, hard_look(np.random.default_rng(10)), np.random.default_rng(10))
    one, other = tracker("sphere").measure(image), tracker("sphere").measure(image)
    assert one.feature is not None and other.feature is not None
    assert np.array_equal(one.feature.s, other.feature.s)


def test_the_image_may_be_read_only_or_a_view_and_is_not_changed() -> None:
    image = render(SPHERE, None, Look(), np.random.default_rng(11))
    copy = image.copy()
    wide = np.repeat(image[:, :, None], 3, axis=2)
    view = wide[:, :, 1]
    image.flags.writeable = False
    assert tracker("sphere").measure(image).found and tracker("sphere").measure(view).found
    assert np.array_equal(image, copy)


def test_wrong_arguments_are_errors() -> None:
    with pytest.raises(ValueError, match="moments method measures spheres"):
        tracker("cylinder", "moments")
    with pytest.raises(ValueError, match="unknown target 'cube'"):
        tracker("cube")
    with pytest.raises(ValueError, match="unknown method"):
        tracker("sphere", "hough")
    with pytest.raises(ValueError, match="grey uint8"):
        tracker("sphere").measure(np.zeros((480, 640, 3), np.uint8))
    assert "smaller" in tracker("sphere").measure(np.zeros((20, 640), np.uint8)).reason


def test_warm_up_needs_no_image() -> None:
    for target in ("sphere", "cylinder"):
        warm_up(target, DEFAULT_INTRINSICS)
    warm_up("sphere", DEFAULT_INTRINSICS, "moments")
