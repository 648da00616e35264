"""The corners of a chessboard to a hundredth of a pixel, from the edges that meet in them.

Around a corner the image is b + c E(d1) E(d2): d1 and d2 are the distances to the two edges
through it, E the profile of a blurred edge. All pixels along the edges take part, as far as no
marker is near; the small windows that markers leave around the corner itself hold much less.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

FloatArray = NDArray[np.float64]
GreyImage = NDArray[np.uint8]

_REACH = 0.42  # of a square, along the edges
_REACH_PX = 16.0  # nor further than this: what is far from the corner says little of its place
_BLUR_PX = 1.2  # kept away from markers, beyond half a pixel
_LEAST_BAND_PX = 2.0  # half the width of the bands along the edges
_MIN_PIXELS = 60
_ITERATIONS = 6
_DONE_PX = 1e-3
_FURTHEST_PX = 1.0  # a corner does not move further than this from where it was
_LEAST_BLUR_PX, _MOST_BLUR_PX = 0.3, 3.0  # a pixel alone spreads an edge over 1 / √12
# Unknowns of a corner: place (2), direction of both edges, curvature of both, log of the edges'
# width, brightness, contrast.
_UNKNOWNS = 9


@dataclass(frozen=True, slots=True)
class _Patches:
    """The pixels taken around each of k corners, padded to the same number."""

    at: FloatArray  # (k, n, 2) relative to the corner's start
    grey: FloatArray  # (k, n)
    used: FloatArray  # (k, n) 0 or 1


def fit_corners(
    image: GreyImage, corners: FloatArray, points: FloatArray, square: float, marker: float
) -> FloatArray:
    """The corners (k, 2) in pixels; one that the model does not fit stays as it was.

    ``corners`` are right to half a pixel, ``points`` (k, 2) are theirs on the board, in the unit
    of ``square`` and ``marker``, the sides of both.
    """
    axes = _board_axes(corners, points, square)
    if not np.all(np.isfinite(axes)):
        return corners
    gap = 0.5 * (square - marker) / square
    patches = _patches(image, corners, axes, gap)
    values = _start(patches, axes)
    for _ in range(_ITERATIONS):
        step = _step(patches, values)
        values = values + step
        values[:, 6] = np.clip(values[:, 6], np.log(_LEAST_BLUR_PX), np.log(_MOST_BLUR_PX))
        if float(np.abs(step[:, :2]).max(initial=0.0)) < _DONE_PX:
            break
    change = values[:, :2]
    good = np.isfinite(values).all(axis=1) & (np.linalg.norm(change, axis=1) < _FURTHEST_PX)
    good &= patches.used.sum(axis=1) >= _MIN_PIXELS
    return np.where(good[:, None], corners + change, corners)


def _board_axes(corners: FloatArray, points: FloatArray, square: float) -> FloatArray:
    """What a square's side along the board's x and y is in the image: (k, 2, 2), by columns."""
    H = np.asarray(cv2.findHomography(points, corners)[0], dtype=float)
    if H.shape != (3, 3):  # None: corners on one line, or nonsense
        return np.full((len(corners), 2, 2), np.nan)
    homogeneous = np.column_stack([points, np.ones(len(points))]) @ H.T
    w = homogeneous[:, 2, None, None]
    seen = homogeneous[:, :2, None] / w
    return np.asarray(square * (H[:2, :2] - seen * H[2, :2]) / w)


def _patches(image: GreyImage, corners: FloatArray, axes: FloatArray, gap: float) -> _Patches:
    """Pixels near the edges through each corner that no marker can reach."""
    height, width = image.shape
    sides_px = np.linalg.norm(axes, axis=1)  # (k, 2)
    limit = np.minimum(_REACH, _REACH_PX / sides_px)[:, None]  # in squares
    reach = int(np.ceil((limit * np.abs(axes)).sum(axis=2).max())) + 1
    offset = np.arange(-reach, reach + 1)
    grid = np.stack(np.meshgrid(offset, offset), axis=-1).reshape(-1, 2)
    pixels = np.round(corners).astype(int)[:, None] + grid  # (k, n, 2)
    at = pixels - corners[:, None]
    board = at @ np.swapaxes(np.linalg.inv(axes), 1, 2)  # in squares
    # Distance in pixels that a step across an edge has: the other axis' height.
    area = np.abs(np.linalg.det(axes))[:, None]
    across = area / sides_px[:, ::-1]  # (k, 2)
    off_px = np.abs(board) * across[:, None]
    band_px = np.maximum(gap * across.min(axis=1) - 0.5 - _BLUR_PX, _LEAST_BAND_PX)
    near = (off_px.min(axis=2) < band_px[:, None]) & np.all(np.abs(board) < limit, axis=2)
    inside = np.all((pixels >= 0) & (pixels < [width, height]), axis=2)
    used = near & inside
    safe = np.clip(pixels, 0, [width - 1, height - 1])
    grey = image[safe[..., 1], safe[..., 0]].astype(float)
    # Those used to the front, so that little is padding.
    order = np.argsort(~used, axis=1, kind="stable")[:, : max(int(used.sum(axis=1).max()), 1)]
    return _Patches(
        np.take_along_axis(at, order[..., None], axis=1),
        np.take_along_axis(grey, order, axis=1),
        np.take_along_axis(used, order, axis=1).astype(float),
    )


def _start(patches: _Patches, axes: FloatArray) -> FloatArray:
    """First values (k, 9): the corner where it is, edges along the board's axes."""
    values = np.zeros((len(axes), _UNKNOWNS))
    angles = np.arctan2(axes[:, 1], axes[:, 0])  # (k, 2)
    values[:, 2:4] = angles
    values[:, 6] = np.log(0.6)
    n = [np.stack([-np.sin(a), np.cos(a)], axis=1) for a in angles.T]
    sign = np.sign(np.einsum("kni,ki->kn", patches.at, n[0]))
    sign *= np.sign(np.einsum("kni,ki->kn", patches.at, n[1]))
    count = patches.used.sum(axis=1) + 1e-9
    values[:, 7] = (patches.used * patches.grey).sum(axis=1) / count
    values[:, 8] = (patches.used * sign * (patches.grey - values[:, 7:8])).sum(axis=1) / count
    return values


def _step(patches: _Patches, values: FloatArray) -> FloatArray:
    """One step (k, 9) of Gauss and Newton, a little damped."""
    width = np.exp(values[:, 6])[:, None]
    from_corner = patches.at - values[:, None, :2]
    edges = []
    for angle, bend in ((values[:, 2], values[:, 4]), (values[:, 3], values[:, 5])):
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        along = c * from_corner[..., 0] + s * from_corner[..., 1]
        off = c * from_corner[..., 1] - s * from_corner[..., 0] - bend[:, None] * along**2
        z = off / width
        profile = erf(z / np.sqrt(2.0))
        slope = np.sqrt(2.0 / np.pi) * np.exp(-0.5 * z**2) / width
        edges.append((c, s, along, z, profile, slope, bend[:, None]))
    contrast = values[:, 8:9]
    J = np.empty((*patches.grey.shape, _UNKNOWNS))
    J[..., :7] = 0.0
    for i, (own, other) in enumerate(((edges[0], edges[1]), (edges[1], edges[0]))):
        c, s, along, z, _, slope, bend = own
        by_off = contrast * slope * other[4]
        J[..., 0] += by_off * (s + 2.0 * bend * along * c)
        J[..., 1] += by_off * (-c + 2.0 * bend * along * s)
        J[..., 2 + i] = -by_off * along
        J[..., 4 + i] = -by_off * along**2
        J[..., 6] -= by_off * z * width
    pattern = edges[0][4] * edges[1][4]
    J[..., 7] = 1.0
    J[..., 8] = pattern
    residual = patches.grey - values[:, 7:8] - contrast * pattern
    weighted = J * patches.used[..., None]
    normal = np.swapaxes(weighted, 1, 2) @ J
    right = np.swapaxes(weighted, 1, 2) @ residual[..., None]
    normal += 1e-6 * np.eye(_UNKNOWNS) * (1e-9 + np.einsum("kii->ki", normal))[:, None]
    return np.asarray(np.linalg.solve(normal, right)[..., 0])
