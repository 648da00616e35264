"""The floor's grey along rays: the plane z = 0 with its texture."""

import numpy as np
from numpy.typing import NDArray

from sim_backend.jit import jit

FloatArray = NDArray[np.float64]
Image = NDArray[np.float32]
# The floor from one pose, by value so that loops keep it in registers, all single precision:
# texel coordinates of the point below the camera (2), their growth with (x, y, 1) (3 + 3),
# the ray's fall with (x, y, 1) (3), -height, most, fade, see ``floor_grey``.
View = tuple[np.float32, ...]

# The texture is laid out this often each way from the camera; few, for single precision.
_PERIODS = 16.0


@jit
def floor_view(T: FloatArray, size: int, texel_m: float, focal_px: float) -> View:
    """The floor as seen from the pose T_base_camera, for ``floor_grey``.

    ``size`` is the texture's period in texels; texel n covers [n, n + 1] texel sizes.
    """
    f = np.float32
    s = 1.0 / texel_m
    height = max(T[2, 3], 1e-6)
    return (
        f((T[0, 3] * s - 0.5) % size + _PERIODS * size),
        f((T[1, 3] * s - 0.5) % size + _PERIODS * size),
        f(T[0, 0] * s),
        f(T[0, 1] * s),
        f(T[0, 2] * s),
        f(T[1, 0] * s),
        f(T[1, 1] * s),
        f(T[1, 2] * s),
        f(T[2, 0]),
        f(T[2, 1]),
        f(T[2, 2]),
        f(-height),
        f(_PERIODS * size * texel_m),
        f(1.0 / (height * texel_m * focal_px)),
    )


@jit
def floor_grey(
    view: View, greys: Image, size: int, mean: np.float32, x: np.float32, y: np.float32
) -> np.float32:
    """The floor's grey along the ray (x, y, 1).

    ``greys`` are the texels of ``padded``; they are interpolated between, their contrast fades
    where a pixel covers more than one, and above the horizon only ``mean`` is left.
    """
    f = np.float32
    dz = min(view[8] * x + view[9] * y + view[10], f(-1e-6))
    t = min(view[11] / dz, view[12])
    # The clamp and ``most`` act where the texture has long faded.
    p = max(view[0] + t * (view[2] * x + view[3] * y + view[4]), f(0))
    q = max(view[1] + t * (view[5] * x + view[6] * y + view[7]), f(0))
    j, i = np.int32(p), np.int32(q)
    a, b = p - f(j), q - f(i)
    mask, stride = np.int32(size - 1), np.uint32(size + 1)
    k = np.uint32(np.int32(i & mask) * np.int32(size + 1) + np.int32(j & mask))
    top = greys[k] + a * (greys[k + np.uint32(1)] - greys[k])
    k += stride
    bottom = greys[k] + a * (greys[k + np.uint32(1)] - greys[k])
    footprint = max(t * t * view[13], f(1))  # texels a pixel covers along the slope
    return np.float32(mean + (top + b * (bottom - top) - mean) / (footprint * footprint))


@jit
def fill_floor(
    image: Image, rays: Image, views: list[View], greys: Image, size: int, mean: np.float32
) -> None:
    """Set ``image`` (h, w) to the floor's mean grey over ``views``; ``rays`` is (2, h, w)."""
    h, w = image.shape
    share = np.float32(1.0 / len(views))
    for v in range(h):
        line, xs, ys = image[v], rays[0, v], rays[1, v]
        view = views[0]
        for u in range(w):
            line[u] = share * floor_grey(view, greys, size, mean, xs[u], ys[u])
        for n in range(1, len(views)):
            view = views[n]
            for u in range(w):
                line[u] += share * floor_grey(view, greys, size, mean, xs[u], ys[u])


def padded(greys: Image) -> Image:
    """The periodic texture (n, n), its first row and column repeated at the end, flattened."""
    return np.ascontiguousarray(np.pad(greys, ((0, 1), (0, 1)), mode="wrap")).ravel()
