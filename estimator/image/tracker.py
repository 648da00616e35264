"""One target from image to image: predicted, searched near there, refined, and certified."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from estimator.image.detect_cylinder import detect_cylinders
from estimator.image.detect_grid import grid_for
from estimator.image.detect_sphere import detect_spheres
from estimator.image.edges_camera import GreyImage, pack_camera
from estimator.image.edges_fit import fit_cylinder_edges, fit_sphere_edges
from estimator.image.edges_refine import refined
from estimator.image.edges_trust import cylinder_doubt, sphere_doubt
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import FloatArray, Intrinsics
from estimator.image.limb_fit import blur_variance_px2
from estimator.image.moments import MomentsMeter

Target = Literal["sphere", "cylinder"]
Method = Literal["limb", "moments"]

_LEAST_SIZE_PX = 48
# How far a target may have moved and grown while it was out of sight, at first and per frame.
_JUMP_PX, _JUMP_PER_FRAME_PX = 40.0, 15.0
_GROWTH, _GROWTH_PER_FRAME = 0.1, 0.03
_TILT_RAD, _TILT_PER_FRAME_RAD = 0.2, 0.05
_FORGET_FRAMES = 30
_NOT_FOUND = {
    "sphere": "no round outline found",
    "cylinder": "no pair of long edges alongside each other found",
}


@dataclass(slots=True)
class _Memory:
    """What earlier images told: the newest measurement, the one before it, and the sign."""

    last: Feature
    before: Feature | None = None
    sign: float = 1.0
    frames_since: int = 1  # 1 when the previous image was measured


class TargetTracker:
    """Measures one target in images of one camera, each starting from what the last one told."""

    def __init__(self, target: Target, intrinsics: Intrinsics, method: Method = "limb") -> None:
        """Raises ValueError for an unknown target or method, and for cylinders by moments."""
        if target not in ("sphere", "cylinder"):
            raise ValueError(f"unknown target {target!r}: choose sphere or cylinder")
        if method not in ("limb", "moments"):
            raise ValueError(f"unknown method {method!r}: choose limb or moments")
        if target == "cylinder" and method == "moments":
            raise ValueError("the moments method measures spheres only: use limb for cylinders")
        self.target = target
        self.intrinsics = intrinsics
        self.method = method
        self._camera = pack_camera(intrinsics)
        self._moments = MomentsMeter(intrinsics) if method == "moments" else None
        self._memory: _Memory | None = None
        self._learnt: FloatArray | None = None  # of blur and noise, from the last image measured

    def reset(self) -> None:
        """Forget all earlier images."""
        self._memory = None
        self._learnt = None

    def measure(self, image: GreyImage, predicted: Feature | None = None) -> Measurement:
        """The target's feature in one grey uint8 image (height, width), or why there is none.

        ``predicted`` is what is expected at this image's exposure; without it the motion between
        the last two measurements is assumed to go on. Raises ValueError for other images.
        """
        if image.ndim != 2 or image.dtype != np.uint8:
            raise ValueError(f"expected a grey uint8 image, got {image.dtype} {image.shape}")
        if min(image.shape) < _LEAST_SIZE_PX:
            return Measurement(None, f"the image is smaller than {_LEAST_SIZE_PX} px")
        if not (image.flags.c_contiguous and image.flags.writeable):
            # Compiled code is specialised on both; a copy is cheaper than compiling again.
            image = image.copy()
        if self._moments is not None:
            near = predicted if predicted is not None else self._last()
            result = self._moments.measure(image, None if near is None else near.s)
            sign = 1.0
        else:
            result, sign = self._tracked(image, predicted)
            if result.feature is None:
                result, sign = self._detected(image, predicted, result.reason)
        return self._remembered(result, sign)

    def _last(self) -> Feature | None:
        return None if self._memory is None else self._memory.last

    def _tracked(self, image: GreyImage, predicted: Feature | None) -> tuple[Measurement, float]:
        """The target near where it is expected, or why it is not there ("" when unknown)."""
        memory = self._memory
        sign = 1.0 if memory is None else memory.sign
        reason = ""
        for guess in self._guesses(predicted):
            result = self._certified(image, guess.s, guess.axis, sign)
            if result.feature is not None and not self._plausible(result.feature, guess, 0):
                result = Measurement(None, "the outline found is not the one tracked")
            if result.feature is not None:
                return result, sign
            reason = reason or result.reason
        return Measurement(None, reason), sign

    def _guesses(self, predicted: Feature | None) -> list[Feature]:
        memory = self._memory
        guesses = [] if predicted is None else [_copied(predicted)]
        if memory is None:
            return guesses
        if predicted is None and memory.before is not None and memory.frames_since == 1:
            guesses.append(_extrapolated(memory.before, memory.last))
        guesses.append(memory.last)
        return guesses

    def _detected(
        self, image: GreyImage, predicted: Feature | None, reason: str
    ) -> tuple[Measurement, float]:
        """The target anywhere in the image; ``reason`` is what tracking already knows."""
        memory = self._memory
        reference = predicted if predicted is not None else self._last()
        gone = 0 if memory is None else memory.frames_since
        for sign in (1.0, -1.0) if memory is None else (memory.sign,):
            for s, axis in self._candidates(image, sign):
                result = self._certified(image, s, axis, sign)
                feature = result.feature
                if feature is not None:
                    if reference is None or self._plausible(feature, reference, gone):
                        return result, sign
                    result = Measurement(None, "the outline found is not the one tracked")
                reason = reason or result.reason
        return Measurement(None, reason or _NOT_FOUND[self.target]), 1.0

    def _candidates(
        self, image: GreyImage, sign: float
    ) -> list[tuple[FloatArray, FloatArray | None]]:
        grid = grid_for(self.intrinsics, (image.shape[0], image.shape[1]), self.target)
        if self.target == "sphere":
            return [(s, None) for s in detect_spheres(image, grid, self._camera, sign)]
        return [(s, a) for s, a in detect_cylinders(image, grid, self._camera, sign)]

    def _certified(
        self, image: GreyImage, s: FloatArray, axis: FloatArray | None, sign: float
    ) -> Measurement:
        """The refined outline near (s, axis) if it is trustworthy, or why it is not."""
        if axis is None:
            fit = fit_sphere_edges(image, self._camera, s, sign)
        else:
            fit = fit_cylinder_edges(image, self._camera, s, axis, sign)
        if fit is None:
            return Measurement(None, _NOT_FOUND[self.target])
        shape = (image.shape[0], image.shape[1])
        doubt = sphere_doubt(fit, shape) if axis is None else cylinder_doubt(fit)
        if doubt and (axis is None or cylinder_doubt(fit, math.inf)):
            return Measurement(None, doubt)
        result, learnt = refined(image, self.intrinsics, self._camera, fit, self._learnt)
        # A blurred side's edges scatter more; how blurred it is only the refinement tells.
        if doubt and (learnt is None or cylinder_doubt(fit, blur_variance_px2(learnt))):
            return Measurement(None, doubt)
        self._learnt = learnt
        return result

    def _plausible(self, feature: Feature, reference: Feature, frames_gone: int) -> bool:
        """Whether a target seen at ``reference`` can be at ``feature`` this many frames later."""
        if frames_gone > _FORGET_FRAMES:
            return True
        norm, norm_0 = np.linalg.norm(feature.s), np.linalg.norm(reference.s)
        growth = abs(float(np.log(norm / norm_0)))
        turn = float(np.arccos(np.clip(feature.s @ reference.s / (norm * norm_0), -1.0, 1.0)))
        limit_px = _JUMP_PX + _JUMP_PER_FRAME_PX * frames_gone
        if growth > _GROWTH + _GROWTH_PER_FRAME * frames_gone:
            return False
        if feature.axis is not None and reference.axis is not None:
            tilt = float(np.arccos(min(1.0, abs(float(feature.axis @ reference.axis)))))
            if tilt > _TILT_RAD + _TILT_PER_FRAME_RAD * frames_gone:
                return False
        return turn * self.intrinsics.fx_px <= limit_px

    def _remembered(self, result: Measurement, sign: float) -> Measurement:
        """Take note of a result; a cylinder's axis keeps the direction it had before."""
        memory, feature = self._memory, result.feature
        if feature is None:
            if memory is not None:
                memory.before = None
                memory.frames_since += 1
            return result
        last_axis = None if memory is None else memory.last.axis
        if feature.axis is not None and last_axis is not None and feature.axis @ last_axis < 0.0:
            feature = Feature(feature.s, feature.covariance, -feature.axis)
        before = memory.last if memory is not None and memory.frames_since == 1 else None
        self._memory = _Memory(feature, before, sign)
        return Measurement(feature)


def _copied(feature: Feature) -> Feature:
    """The same with plain float arrays, as compiled code wants them."""
    axis = None if feature.axis is None else np.array(feature.axis, dtype=float)
    return Feature(np.array(feature.s, dtype=float), feature.covariance, axis)


def _extrapolated(before: Feature, last: Feature) -> Feature:
    """Where the motion from ``before`` to ``last`` leads one image later."""
    s = 2.0 * last.s - before.s
    if last.axis is None or before.axis is None:
        return Feature(s, last.covariance)
    axis = 2.0 * last.axis - before.axis
    axis = axis / np.linalg.norm(axis)
    return Feature(s - axis * float(axis @ s), last.covariance, axis)


def warm_up(target: Target, intrinsics: Intrinsics, method: Method = "limb") -> None:
    """Compile everything that measuring will call, on a drawn image."""
    width = round(2.0 * intrinsics.cx_px) + 1
    height = round(2.0 * intrinsics.cy_px) + 1
    v, u = np.mgrid[: max(height, 120), : max(width, 120)]
    u, v = u - u.mean(), v - v.mean()
    away = np.hypot(u, v) if target == "sphere" else np.abs(u)
    share = np.clip(0.2 * min(u.max(), v.max()) + 10.0 - away, 0.0, 1.0)
    # Without noise the refinement would be doubted, and what comes after it not be called.
    noise = np.random.default_rng(0).normal(0.0, 2.0, share.shape)
    image = np.rint(20.0 + 200.0 * share + noise).astype(np.uint8)
    tracker = TargetTracker(target, intrinsics, method)
    for _ in range(3):
        tracker.measure(image)
