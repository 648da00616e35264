"""The printed ChArUco board as rectangles of constant grey in its own plane."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sim_backend.config_targets import BoardConfig

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Board:
    """A rectangular sheet on which rows and columns of cells are printed.

    Its frame is OpenCV's for boards: x along the rows, y down the columns, z away from the
    viewer, the origin at the pattern's first corner. From behind the sheet is plain white.
    """

    T_base_board: FloatArray  # (4, 4)
    columns_m: FloatArray  # (n + 1,) where cells begin along x, and the sheet's end
    rows_m: FloatArray  # (m + 1,) along y
    greys: FloatArray  # (m, n) the cells' albedo
    middle_m: FloatArray  # (3,) of the pattern, in base
    white_grey: float


def build_board(config: BoardConfig) -> Board:
    """The board as OpenCV lays it out, at its configured place."""
    width_m, height_m = config.size_m
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(config.rotvec_rad).as_matrix()
    middle_m = np.array(config.position_m, float)
    T[:3, 3] = middle_m - T[:3, :3] @ [width_m / 2, height_m / 2, 0.0]
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, config.dictionary))
    modules = dictionary.markerSize + 2  # a marker's bits and its black border
    columns_m = _breaks(config.squares[0], config, modules)
    rows_m = _breaks(config.squares[1], config, modules)
    greys = np.full((rows_m.size - 1, columns_m.size - 1), config.white_grey)
    greys[1:-1, 1:-1] = config.black_grey
    side = modules + 2  # cells of a square: the marker and its gap on both sides
    layout = cv2.aruco.CharucoBoard(config.squares, config.square_m, config.marker_m, dictionary)
    layout.setLegacyPattern(config.legacy)
    for number, corners in zip(np.ravel(layout.getIds()), layout.getObjPoints(), strict=True):
        middle = np.mean(np.asarray(corners)[:, :2], axis=0) / config.square_m
        i, j = 1 + side * int(middle[1]), 1 + side * int(middle[0])
        bits = cv2.aruco.generateImageMarker(dictionary, int(number), modules)
        greys[i : i + side, j : j + side] = config.white_grey
        greys[i + 1 : i + side - 1, j + 1 : j + side - 1][bits < 128] = config.black_grey
    return Board(T, columns_m, rows_m, greys, middle_m, config.white_grey)


def _breaks(squares: int, config: BoardConfig, modules: int) -> FloatArray:
    """Where cells begin: the margin, then in every square its own margin and the modules."""
    gap_m = (config.square_m - config.marker_m) / 2
    inside_m = gap_m + config.marker_m / modules * np.arange(modules + 1)
    square_m = np.concatenate([[0.0], inside_m])
    all_m = (config.square_m * np.arange(squares)[:, None] + square_m).ravel()
    end_m = config.square_m * squares
    return np.concatenate([[-config.margin_m], all_m, [end_m, end_m + config.margin_m]])
