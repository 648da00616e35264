"""The ChArUco board: its definition in the rig's configuration, and its points."""

import re
from typing import Annotated, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from rig.config_section import Positive, Section

FloatArray = NDArray[np.float64]

Squares = Annotated[int, Field(ge=3, le=40)]
_DICTIONARY = re.compile(r"DICT_[4-7]X[4-7]_(50|100|250|1000)")
_SIZES = {"4X4": 4, "5X5": 5, "6X6": 6, "7X7": 7}


class BoardConfig(Section):
    """A chessboard with a marker in every white square, as it was printed.

    Its frame is OpenCV's: the origin at the outer corner of the first square, x along a row of
    squares, y down a column, z away from the viewer.
    """

    squares: tuple[Squares, Squares] = (7, 5)  # in a row, in a column
    square_m: Positive = 0.030
    marker_m: Positive = 0.022
    dictionary: str = "DICT_4X4_50"
    # Boards printed by programs based on OpenCV before 4.6, with an even number of rows.
    legacy: bool = False

    @model_validator(mode="after")
    def _printable(self) -> Self:
        if not 0.3 * self.square_m <= self.marker_m <= 0.95 * self.square_m:
            raise ValueError(
                f"marker_m = {self.marker_m:g} must be between 0.3 and 0.95 of "
                f"square_m = {self.square_m:g}"
            )
        known = _DICTIONARY.fullmatch(self.dictionary)
        if known is None or _bits(self.dictionary) == 0:
            raise ValueError(
                f"dictionary = {self.dictionary!r} is none of DICT_NXN_M with N = 4, 5, 6, 7 and "
                "M = 50, 100, 250, 1000"
            )
        markers, most = self.squares[0] * self.squares[1] // 2, int(known[1])
        if markers > most:
            raise ValueError(
                f"{self.squares[0]}x{self.squares[1]} squares need {markers} markers, "
                f"{self.dictionary} has {most}"
            )
        return self

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of the pattern."""
        return self.squares[0] * self.square_m, self.squares[1] * self.square_m

    @property
    def marker_bits(self) -> int:
        """How many bits a marker has along a side, without its border."""
        return _bits(self.dictionary)

    def __str__(self) -> str:
        legacy = ", legacy" if self.legacy else ""
        return (
            f"{self.squares[0]}x{self.squares[1]} squares of {1e3 * self.square_m:g} mm, markers "
            f"of {1e3 * self.marker_m:g} mm, {self.dictionary}{legacy}"
        )


def opencv_board(config: BoardConfig) -> cv2.aruco.CharucoBoard:
    """The board as OpenCV's detector takes it."""
    dictionary = cv2.aruco.getPredefinedDictionary(int(getattr(cv2.aruco, config.dictionary)))
    board = cv2.aruco.CharucoBoard(config.squares, config.square_m, config.marker_m, dictionary)
    board.setLegacyPattern(config.legacy)
    return board


def corner_points(config: BoardConfig) -> FloatArray:
    """The inner corners (n, 3) in the board's frame, row by row: number i is OpenCV's id i."""
    columns, rows = config.squares
    y, x = np.mgrid[1:rows, 1:columns]
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return np.asarray(config.square_m * flat, dtype=float)


def _bits(dictionary: str) -> int:
    return _SIZES.get(dictionary.removeprefix("DICT_")[:3], 0)
