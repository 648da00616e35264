"""Accuracy and cost of measuring an outline: `python -m benchmarks.bench_limb [frames] [seeds]`.

Prints, for the four sequences of exact images, the relative error of |s| (rms, mean, largest), how
many frames were lost, the normalised squared error (1 when the covariance is honest), and the CPU
time of a frame on one thread: for the refinement alone, from an outline wrong by up to 0.5 px, and
for the whole measurement from pixels.
"""

import os
import sys
import time
from collections.abc import Callable, Iterator

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import numpy as np  # noqa: E402

from estimator.image.intrinsics import FloatArray  # noqa: E402
from estimator.image.limb_fit import refine_cylinder, refine_sphere  # noqa: E402
from estimator.image.tracker import TargetTracker  # noqa: E402
from tests.estimator.image.exact_images import (  # noqa: E402
    DEFAULT_INTRINSICS,
    Sample,
    sequence,
)

Result = tuple[FloatArray, FloatArray] | None  # s and its covariance
Measure = Callable[[Sample], Result]
SEQUENCES = [(target, kind) for kind in ("clean", "hard") for target in ("sphere", "cylinder")]


def refinement(seed: int) -> Measure:
    """The refinement alone, from a guess wrong by up to half a pixel."""
    rng = np.random.default_rng(seed)

    def measure(sample: Sample) -> Result:
        s, length = sample.s, float(np.linalg.norm(sample.s))
        wrong = np.array([s[2] / 800.0, s[2] / 800.0, length / 80.0])
        s0 = s + 0.5 * rng.uniform(-1.0, 1.0, 3) * wrong
        if sample.axis is None:
            fit = refine_sphere(sample.image, DEFAULT_INTRINSICS, s0)
        else:
            axis0 = sample.axis + rng.normal(0.0, 3e-4, 3)
            fit = refine_cylinder(sample.image, DEFAULT_INTRINSICS, s0, axis0)
        return None if fit is None else (fit.s, fit.covariance)

    return measure


def from_pixels(target: str) -> Measure:
    """The whole measurement, tracking from image to image."""
    tracker = TargetTracker("sphere" if target == "sphere" else "cylinder", DEFAULT_INTRINSICS)

    def measure(sample: Sample) -> Result:
        feature = tracker.measure(sample.image).feature
        return None if feature is None else (feature.s, feature.covariance)

    return measure


def report(name: str, measure: Measure, samples: Iterator[Sample]) -> None:
    """Run one sequence and print its line."""
    errors, normalised, cpu_ms, lost = [], [], [], 0
    for sample in samples:
        started = time.thread_time()
        result = measure(sample)
        cpu_ms.append(1e3 * (time.thread_time() - started))
        if result is None:
            lost += 1
            continue
        s, covariance = result
        length = float(np.linalg.norm(sample.s))
        towards = sample.s / length
        errors.append(float(np.linalg.norm(s)) / length - 1.0)
        normalised.append((errors[-1] * length) ** 2 / float(towards @ covariance @ towards))
    e = np.array(errors)
    print(
        f"{name:34s} {np.sqrt(np.mean(e**2)):9.2e} {np.mean(e):+9.2e} {np.max(np.abs(e)):9.2e}"
        f" {lost:5d} {np.mean(normalised):6.2f} {np.median(cpu_ms):7.2f}"
        f" {np.percentile(cpu_ms, 99):7.2f}",
        flush=True,
    )


def main(frames: int, seeds: int) -> None:
    """All four sequences for each seed."""
    print(f"{'':34s} {'rms':>9s} {'bias':>9s} {'max':>9s}  lost   nees  cpu_ms  p99_ms")
    for target in ("sphere", "cylinder"):  # compile
        for sample in sequence(target, "clean", 99, 2):
            refinement(0)(sample)
            from_pixels(target)(sample)
    for seed in range(seeds):
        for target, kind in SEQUENCES:
            name = f"{target} {kind} {seed}"
            report(f"{name}: refinement", refinement(seed), sequence(target, kind, seed, frames))
            report(
                f"{name}: from pixels", from_pixels(target), sequence(target, kind, seed, frames)
            )


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]]
    main(*(numbers + [300, 1][len(numbers) :]))
