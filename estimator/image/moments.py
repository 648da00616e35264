"""The paper's path for the sphere: threshold, image moments, then s by (9)-(11).

(10) is used as corrected: a1^2 = 2 (n20 + n02 - sqrt((n20 - n02)^2 + 4 n11^2)), with n_ij the
central moments divided by the area and a1 the minor semi-axis of the outline.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from estimator.image.edges_camera import GreyImage
from estimator.image.feature import Feature, Measurement
from estimator.image.intrinsics import FloatArray, Intrinsics

_LEAST_AREA_PX = 300.0
_LEAST_CONTRAST_GREY = 20.0
_MOST_AREA_ERROR = 0.015  # of the area, against the ellipse with the same moments
_MOST_SHAPE_ERROR = 0.02  # of the second moments, against those of a sphere's outline
_CANDIDATES = 3
# Standard deviation of the outline, per pixel of its length, where pixels are in or out.
_OUTLINE_SIGMA_PX = 0.5


@dataclass(frozen=True, slots=True)
class BlobMoments:
    """Area, centre and central second moments / area of a blob, in normalised coordinates."""

    area: float
    centre: FloatArray  # (2,) x_g, y_g
    second: FloatArray  # (2, 2) n20 n11; n11 n02


def s_of_moments(moments: BlobMoments) -> FloatArray:
    """s (3,) of the sphere whose outline has these moments; eqs. (9)-(11)."""
    n20, n11, n02 = moments.second[0, 0], moments.second[0, 1], moments.second[1, 1]
    a1_squared = 2.0 * (n20 + n02 - np.sqrt((n20 - n02) ** 2 + 4.0 * n11**2))
    s_z = np.sqrt((1.0 + a1_squared) / a1_squared)
    x_g, y_g = moments.centre
    return np.array([x_g / (s_z * a1_squared), y_g / (s_z * a1_squared), s_z])


def expected_second(s: FloatArray) -> FloatArray:
    """The central second moments / area (2, 2) of the outline of a sphere at s (3,)."""
    a1_squared = 1.0 / (s[2] ** 2 - 1.0)
    centre = s[:2] * s[2] * a1_squared
    # The minor semi-axis is a1; the major one points away from the optical axis.
    shape: FloatArray = 0.25 * (
        a1_squared * np.eye(2) + a1_squared / (1.0 + a1_squared) * np.outer(centre, centre)
    )
    return shape


class MomentsMeter:
    """Measures spheres by thresholding and moments in images of one camera."""

    def __init__(self, intrinsics: Intrinsics) -> None:
        self._intrinsics = intrinsics
        self._maps: tuple[FloatArray, FloatArray] | None = None

    def measure(self, image: GreyImage, near: FloatArray | None = None) -> Measurement:
        """s of the blob nearest to ``near`` (3,) in direction, or of the largest round one."""
        level, contrast = _level(image)
        if contrast < _LEAST_CONTRAST_GREY:
            return Measurement(None, "nothing stands out from the background")
        mask = (image > level).view(np.uint8)
        border = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
        if border.mean() > 0.5:  # a dark target on a bright background
            mask = 1 - mask
        count, labels, stats, centres = cv2.connectedComponentsWithStats(mask, connectivity=8)
        order = np.argsort(-stats[1:count, cv2.CC_STAT_AREA]) + 1
        if near is not None:
            aim = self._intrinsics.project(near[None, :])[0]
            order = order[np.argsort(np.hypot(*(centres[order] - aim).T), kind="stable")]
        reason = "no blob is large enough"
        for label in order[:_CANDIDATES]:
            box = stats[label]
            if box[cv2.CC_STAT_AREA] < _LEAST_AREA_PX:
                continue
            found = self._blob(labels, int(label), box)
            if found.feature is not None:
                return found
            reason = found.reason
        return Measurement(None, reason)

    def _blob(self, labels: NDArray[Any], label: int, box: NDArray[Any]) -> Measurement:
        left, top, width, height = (int(value) for value in box[:4])
        rows, columns = labels.shape
        if left < 1 or top < 1 or left + width > columns - 1 or top + height > rows - 1:
            return Measurement(None, "the blob reaches the border of the image")
        inside = labels[top : top + height, left : left + width] == label
        moments = self._moments(inside, left, top, labels.shape)
        ellipse_area = 4.0 * np.pi * np.sqrt(max(float(np.linalg.det(moments.second)), 0.0))
        if not abs(moments.area / ellipse_area - 1.0) < _MOST_AREA_ERROR:
            return Measurement(None, "the blob is not elliptical")
        s = s_of_moments(moments)
        expected = expected_second(s)
        error = np.max(np.abs(moments.second - expected)) / np.trace(expected)
        if not error < 0.5 * _MOST_SHAPE_ERROR:
            return Measurement(None, "the blob is no sphere's outline")
        return Measurement(Feature(s, self._covariance(s)))

    def _moments(
        self, inside: NDArray[np.bool_], left: int, top: int, shape: tuple[int, ...]
    ) -> BlobMoments:
        k = self._intrinsics
        if not k.distorted:
            m = cv2.moments(inside.view(np.uint8), binaryImage=True)
            scale = np.array([1.0 / k.fx_px, 1.0 / k.fy_px])
            centre_px = np.array([m["m10"], m["m01"]]) / m["m00"] + (left, top)
            centre = (centre_px - (k.cx_px, k.cy_px)) * scale
            second = np.array([[m["mu20"], m["mu11"]], [m["mu11"], m["mu02"]]]) / m["m00"]
            return BlobMoments(
                m["m00"] * float(np.prod(scale)), centre, second * np.outer(scale, scale)
            )
        if self._maps is None or self._maps[1].shape != shape:
            self._maps = _undistorted_maps(k, shape)
        height, width = inside.shape
        xy = self._maps[0][top : top + height, left : left + width][inside]
        weight = self._maps[1][top : top + height, left : left + width][inside]
        area = float(weight.sum())
        centre = weight @ xy / area
        offset = xy - centre
        return BlobMoments(area, centre, (weight[:, None] * offset).T @ offset / area)

    def _covariance(self, s: FloatArray) -> FloatArray:
        """Covariance (3, 3) of s from independent errors along the outline."""
        norm = float(np.linalg.norm(s))
        direction = s / norm
        radius_px = self._intrinsics.fx_px / np.sqrt(norm**2 - 1.0)
        sigma_px = _OUTLINE_SIGMA_PX / np.sqrt(2.0 * np.pi * radius_px)
        along = norm * sigma_px / radius_px
        across = np.sqrt(2.0) * norm * sigma_px / self._intrinsics.fx_px
        towards = np.outer(direction, direction)
        covariance: FloatArray = along**2 * towards + across**2 * (np.eye(3) - towards)
        return covariance


def _level(image: GreyImage) -> tuple[float, float]:
    """The grey half-way between Otsu's two classes, and their difference.

    Otsu's own level lies anywhere between the classes, which moves a blurred outline.
    """
    otsu, _ = cv2.threshold(image, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    counts = np.bincount(image.ravel(), minlength=256).astype(float)
    grey = np.arange(256)
    low, high = grey <= otsu, grey > otsu
    if counts[low].sum() == 0.0 or counts[high].sum() == 0.0:
        return 0.0, 0.0
    dark = float(grey[low] @ counts[low] / counts[low].sum())
    bright = float(grey[high] @ counts[high] / counts[high].sum())
    return 0.5 * (dark + bright), bright - dark


def _undistorted_maps(
    intrinsics: Intrinsics, shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """Normalised coordinates (height, width, 2) of all pixels and each pixel's area there."""
    u, v = np.meshgrid(np.arange(shape[1], dtype=float), np.arange(shape[0], dtype=float))
    at = np.stack([u, v], axis=-1)
    half_u, half_v = np.array([0.5, 0.0]), np.array([0.0, 0.5])
    along_u = intrinsics.normalise(at + half_u) - intrinsics.normalise(at - half_u)
    along_v = intrinsics.normalise(at + half_v) - intrinsics.normalise(at - half_v)
    area = along_u[..., 0] * along_v[..., 1] - along_u[..., 1] * along_v[..., 0]
    return intrinsics.normalise(at), area
