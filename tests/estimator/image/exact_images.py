"""Images of spheres and cylinders whose outline is known exactly, for tests and benchmarks.

Silhouettes are area coverage: each pixel near the outline is cut into 4 x 4 cells, and each
cell's share is the exact area on the inner side of the straight edge through it (what is left,
the outline's bend inside a cell, is below 1e-4 px). Motion blur averages sub-exposures of the
moving target, a point spread blurs an image of twice the size before it is averaged to pixels;
sums are kept in floating point until noise is added and the result rounded.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from estimator.image.intrinsics import Intrinsics
from tests.estimator.image.exact_coverage import CELLS, expose

FloatArray = NDArray[np.float64]
GreyImage = NDArray[np.uint8]

WIDTH_PX, HEIGHT_PX = 640, 480
_FINER = 2  # an image that a point spread blurs
DEFAULT_INTRINSICS = Intrinsics(800.0, 800.0, 319.5, 239.5)
SPHERE_RADIUS_M, CYLINDER_RADIUS_M = 0.019, 0.042


@dataclass(frozen=True, slots=True)
class Look:
    """Everything about an image that is not geometry."""

    foreground: float = 220.0  # grey of an unlit target
    background: float | FloatArray = 20.0  # grey, or a texture (height, width)
    light: FloatArray | None = None  # (3,) towards the light, camera frame; None: flat grey
    lit_range: tuple[float, float] = (115.0, 230.0)  # grey where the light does not / fully hits
    wrapped_light: bool = False  # grey follows (1 + n.l) / 2 instead of max(0, n.l)
    blur_px: tuple[float, float] = (0.0, 0.0)  # image motion of the target during the exposure
    growth: float = 0.0  # relative change of distance during the exposure
    psf_sigma_px: float = 0.0
    noise_grey: float = 2.0
    sub_exposures: int = 16


@dataclass(frozen=True, slots=True)
class Sample:
    """One image and the truth at its mid-exposure."""

    image: GreyImage  # (height, width)
    s: FloatArray  # (3,)
    axis: FloatArray | None = field(default=None)  # (3,), cylinder only


def cylinder_s(point: FloatArray, axis: FloatArray) -> FloatArray:
    """The part of ``point`` (3,) that is normal to the unit ``axis`` (3,)."""
    s: FloatArray = point - axis * float(axis @ point)
    return s


def texture(
    rng: np.random.Generator,
    correlation_px: float,
    low: float = 5.0,
    high: float = 110.0,
) -> FloatArray:
    """A smooth random background (height, width) spanning ``low`` to ``high`` grey."""
    white = rng.standard_normal((HEIGHT_PX, WIDTH_PX))
    smooth = cv2.GaussianBlur(white, (0, 0), correlation_px) if correlation_px > 0.3 else white
    smooth = (smooth - smooth.mean()) / (2.5 * smooth.std())
    clipped: FloatArray = low + (high - low) * np.clip(0.5 + 0.5 * smooth, 0.0, 1.0)
    return clipped


def blocks(
    rng: np.random.Generator, count: int = 400, low: float = 5.0, high: float = 110.0
) -> FloatArray:
    """A background (height, width) of overlapping rotated rectangles with sharp edges."""
    canvas = np.full((HEIGHT_PX, WIDTH_PX), 0.5 * (low + high))
    for _ in range(count):
        centre = rng.uniform((0.0, 0.0), (WIDTH_PX, HEIGHT_PX))
        size = rng.uniform(6.0, 70.0, 2)
        corners = cv2.boxPoints((tuple(centre), tuple(size), float(rng.uniform(0.0, 180.0))))
        cv2.fillConvexPoly(canvas, corners.astype(np.int32), float(rng.uniform(low, high)))
    return canvas


def render(
    s: FloatArray,
    axis: FloatArray | None,
    look: Look,
    rng: np.random.Generator,
    intrinsics: Intrinsics = DEFAULT_INTRINSICS,
) -> GreyImage:
    """One exposure of the target at s (3,) and, for a cylinder, ``axis`` (3,): grey uint8."""
    exact = render_exact(s, axis, look, intrinsics)
    noisy = exact + look.noise_grey * rng.standard_normal(exact.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def render_exact(
    s: FloatArray, axis: FloatArray | None, look: Look, intrinsics: Intrinsics = DEFAULT_INTRINSICS
) -> FloatArray:
    """The noise-free exposure (height, width) in grey, not rounded."""
    if look.psf_sigma_px == 0.0:
        return _exposed(s, axis, look, intrinsics, 1)
    # The lens blurs before the pixels average.
    sigma = _FINER * look.psf_sigma_px
    fine = _exposed(s, axis, look, intrinsics, _FINER)
    blurred = cv2.GaussianBlur(fine, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
    pixels: FloatArray = blurred.reshape(HEIGHT_PX, _FINER, WIDTH_PX, _FINER).mean(axis=(1, 3))
    return pixels


def _exposed(
    s: FloatArray, axis: FloatArray | None, look: Look, intrinsics: Intrinsics, finer: int
) -> FloatArray:
    """The exposure through a perfect lens, ``finer`` times as many pixels each way."""
    shape = (HEIGHT_PX * finer, WIDTH_PX * finer)
    coverage, grey_sum = np.zeros(shape), np.zeros(shape)
    a = np.zeros(3) if axis is None else axis
    light = np.zeros(3) if look.light is None else look.light / np.linalg.norm(look.light)
    low, high = (look.foreground,) * 2 if look.light is None else look.lit_range
    moving = look.blur_px != (0.0, 0.0) or look.growth != 0.0
    instants = (np.arange(look.sub_exposures) + 0.5) / look.sub_exposures - 0.5
    rays_x, rays_y = _cell_rays(intrinsics, finer)
    for instant in instants if moving else [0.0]:
        s_now = _moved(s, axis, look, intrinsics, float(instant))
        expose(
            coverage, grey_sum, rays_x, rays_y, s_now, a, light, low, high,
            look.wrapped_light,
        )  # fmt: skip
    count = look.sub_exposures if moving else 1
    background = np.broadcast_to(look.background, (HEIGHT_PX, WIDTH_PX))
    behind = np.repeat(np.repeat(background, finer, axis=0), finer, axis=1)
    return np.asarray(grey_sum / count + (1.0 - coverage / count) * behind, dtype=float)


def _moved(
    s: FloatArray, axis: FloatArray | None, look: Look, intrinsics: Intrinsics, instant: float
) -> FloatArray:
    """The target at ``instant`` (exposures) from mid-exposure, moved parallel to the image."""
    lateral = np.array([look.blur_px[0] / intrinsics.fx_px, look.blur_px[1] / intrinsics.fy_px, 0])
    moved: FloatArray = s * (1.0 + instant * look.growth) + instant * lateral * s[2]
    return moved if axis is None else cylinder_s(moved, axis)


_rays_cache: dict[tuple[float, ...], tuple[FloatArray, FloatArray]] = {}


def _cell_rays(intrinsics: Intrinsics, finer: int) -> tuple[FloatArray, FloatArray]:
    """Normalised x and y, each (height * n, width * n), of every cell's centre."""
    key = (
        intrinsics.fx_px, intrinsics.fy_px, intrinsics.cx_px, intrinsics.cy_px,
        *intrinsics.distortion.tolist(), finer,
    )  # fmt: skip
    if key not in _rays_cache:
        _rays_cache.clear()
        n = CELLS * finer
        u = (np.arange(WIDTH_PX * n) + 0.5) / n - 0.5
        v = (np.arange(HEIGHT_PX * n) + 0.5) / n - 0.5
        xy = intrinsics.normalise(np.stack(np.meshgrid(u, v), axis=-1))
        _rays_cache[key] = (np.ascontiguousarray(xy[..., 0]), np.ascontiguousarray(xy[..., 1]))
    return _rays_cache[key]


def hard_look(rng: np.random.Generator, correlation_px: float = 4.0, speed_px: float = 3.0) -> Look:
    """Side light, textured clutter, motion blur and noise, all drawn from ``rng``."""
    around = rng.uniform(0.0, 2.0 * np.pi)
    heading = rng.uniform(0.0, 2.0 * np.pi)
    return Look(
        background=texture(rng, correlation_px),
        light=np.array([np.cos(around), np.sin(around), -rng.uniform(0.1, 0.8)]),
        blur_px=(speed_px * np.cos(heading), speed_px * np.sin(heading)),
        noise_grey=5.0,
    )


def sphere_path(rng: np.random.Generator, frames: int) -> FloatArray:
    """Smooth s (frames, 3): distance 0.21 to 0.30 m, image motion up to 5 px a frame."""
    t = np.arange(frames)
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)
    z_m = 0.255 + 0.045 * np.sin(2.0 * np.pi * t / 150.0 + phase[2])
    # Amplitude times angular frequency, both axes together, is 5 px a frame at most.
    u = 110.0 * np.sin(t * 3.2 / 110.0 + phase[0]) / 800.0
    v = 70.0 * np.sin(t * 3.2 / 70.0 + phase[1]) / 800.0
    points = np.stack([u * z_m, v * z_m, z_m], axis=-1) / SPHERE_RADIUS_M
    return np.asarray(points, dtype=float)


def cylinder_path(rng: np.random.Generator, frames: int) -> tuple[FloatArray, FloatArray]:
    """Smooth s (frames, 3) at 0.36 to 0.48 m and unit axes (frames, 3) of varying tilt."""
    t = np.arange(frames)
    phase = rng.uniform(0.0, 2.0 * np.pi, 4)
    roll = rng.uniform(0.0, np.pi) + 0.6 * np.sin(2.0 * np.pi * t / 300.0 + phase[0])
    tilt = 0.35 * np.sin(2.0 * np.pi * t / 200.0 + phase[1])
    axes = np.stack(
        [np.cos(roll) * np.cos(tilt), np.sin(roll) * np.cos(tilt), np.sin(tilt)], axis=-1
    )
    z_m = 0.42 + 0.06 * np.sin(2.0 * np.pi * t / 150.0 + phase[2])
    offset = 45.0 * np.sin(t * 3.2 / 45.0 + phase[3]) / 800.0
    points = np.stack([-np.sin(roll) * offset * z_m, np.cos(roll) * offset * z_m, z_m], axis=-1)
    s = np.stack([cylinder_s(p, a) for p, a in zip(points / CYLINDER_RADIUS_M, axes, strict=True)])
    return s, axes


def sequence(
    target: str,
    kind: str,
    seed: int,
    frames: int = 300,
    look: Look | None = None,
    intrinsics: Intrinsics = DEFAULT_INTRINSICS,
) -> Iterator[Sample]:
    """The README's sequences: ``target`` sphere or cylinder, ``kind`` clean or hard.

    Each seed has its own path, light, texture and blur direction; in a hard sequence light and
    blur direction also turn slowly. ``look`` replaces the kind's appearance.
    """
    rng = np.random.default_rng(seed)
    if look is None:
        look = Look() if kind == "clean" else hard_look(rng, float(rng.uniform(2.0, 8.0)))
    if target == "sphere":
        path: FloatArray = sphere_path(rng, frames)
        axes = None
    else:
        path, axes = cylinder_path(rng, frames)
    for index in range(frames):
        axis = None if axes is None else axes[index]
        now = turned(look, 2.0 * np.pi * index / 300.0)
        yield Sample(render(path[index], axis, now, rng, intrinsics), path[index], axis)


def turned(look: Look, angle_rad: float) -> Look:
    """``look`` with light and blur turned about the optical axis by ``angle_rad``."""
    c, s = float(np.cos(angle_rad)), float(np.sin(angle_rad))
    bx, by = look.blur_px
    light = look.light
    if light is not None:
        light = np.array([c * light[0] - s * light[1], s * light[0] + c * light[1], light[2]])
    return replace(look, blur_px=(c * bx - s * by, s * bx + c * by), light=light)
