"""Finding the simulated board's corners in pictures, and where they should be."""

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_backend.board import Board
from sim_backend.config_targets import BoardConfig
from sim_backend.lens import Lens

FloatArray = NDArray[np.float64]


def layout(config: BoardConfig) -> cv2.aruco.CharucoBoard:
    """The board as OpenCV knows it."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, config.dictionary))
    board = cv2.aruco.CharucoBoard(config.squares, config.square_m, config.marker_m, dictionary)
    board.setLegacyPattern(config.legacy)
    return board


def found(image: FloatArray, config: BoardConfig) -> tuple[FloatArray, FloatArray]:
    """Pixels (n, 2) of the corners found, and where they are on the board (n, 3).

    The picture is smoothed a little before the corners are refined: sampled by square pixels
    alone, edges are too sharp for OpenCV's gradients, which then err by 0.04 px.
    """
    grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    board = layout(config)
    pixels, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(grey)
    if ids is None:
        return np.empty((0, 2)), np.empty((0, 3))
    smooth = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), 1.0)
    until = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 50, 1e-4)
    pixels = cv2.cornerSubPix(smooth, pixels.reshape(-1, 1, 2), (4, 4), (-1, -1), until)
    points = np.asarray(board.getChessboardCorners(), float)[ids.ravel()]
    return pixels.reshape(-1, 2).astype(float), points


def expected(points: FloatArray, board: Board, lens: Lens, T_base_camera: FloatArray) -> FloatArray:
    """Pixels (n, 2) of points (n, 3) on the board."""
    T = np.linalg.inv(T_base_camera) @ board.T_base_board
    return lens.project(points @ T[:3, :3].T + T[:3, 3])


def rms(errors: FloatArray) -> float:
    """Root mean square per coordinate."""
    return float(np.sqrt(np.mean(np.square(errors))))
