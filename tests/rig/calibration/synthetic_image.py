"""Pictures of the board through a pinhole: many rays a pixel, each of them exact."""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.calibration.board import BoardConfig, opencv_board
from rig.calibration.projection import camera_matrix
from tests.rig.calibration.synthetic import SIZE, FloatArray, Truth

_RAYS = 4  # a side of a pixel
_PER_MM = 8
_MARGIN_MM = 10


def print_of(board: BoardConfig) -> NDArray[np.uint8]:
    """The board on white paper, 8 px a millimetre."""
    width, height = (round(1e3 * _PER_MM * side) for side in board.size_m)
    pattern = opencv_board(board).generateImage((width, height), marginSize=0)
    return np.pad(pattern, _MARGIN_MM * _PER_MM, constant_values=255)


def picture(
    truth: Truth, T_base_tool: FloatArray, paper: NDArray[np.uint8], rng: np.random.Generator
) -> NDArray[np.uint8]:
    """What the camera sees: paper at 220, ink at 20, the rest at 60, noise of 2."""
    T = truth.camera_from_tool(T_base_tool)
    to_image = camera_matrix(truth.intrinsics) @ T[:3, [0, 1, 3]]
    # Pixel centres lie at integers, on the paper, in the image and among the rays.
    metre, margin = 1e3 * _PER_MM, _MARGIN_MM * _PER_MM
    from_paper = np.array(
        [[1 / metre, 0, (0.5 - margin) / metre], [0, 1 / metre, (0.5 - margin) / metre], [0, 0, 1]]
    )
    shift = (_RAYS - 1) / 2
    to_rays = np.array([[_RAYS, 0, shift], [0, _RAYS, shift], [0, 0, 1.0]])
    size = (_RAYS * SIZE[0], _RAYS * SIZE[1])
    ink = 20.0 + paper.astype(np.float32) * (200.0 / 255.0)
    rays = cv2.warpPerspective(
        ink, to_rays @ to_image @ from_paper, size, flags=cv2.INTER_NEAREST, borderValue=60.0
    )
    mean = rays.reshape(SIZE[1], _RAYS, SIZE[0], _RAYS).mean(axis=(1, 3))
    noisy = np.round(mean + 2.0 * rng.standard_normal(mean.shape))
    return np.clip(noisy, 0, 255).astype(np.uint8)
