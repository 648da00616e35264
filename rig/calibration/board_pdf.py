"""The board on paper, to scale, with a ruler to check the print and its definition to copy."""

from typing import Literal

import cv2
import numpy as np

from drivers.errors import ConfigError
from rig.calibration.board import BoardConfig, opencv_board
from rig.calibration.pdf import PdfPage

Paper = Literal["a4", "a3", "letter"]

PAPERS_MM: dict[Paper, tuple[float, float]] = {
    "a4": (210.0, 297.0),
    "a3": (297.0, 420.0),
    "letter": (215.9, 279.4),
}
_MARGIN_MM = 8.0  # most printers reach this far
_FOOT_MM = 22.0  # ruler and definition
_RULER_MM = 100


def board_pdf(config: BoardConfig, paper: Paper) -> bytes:
    """The PDF file of the board on one page, upright or across, whichever fits.

    Raises ConfigError when neither does; it names the squares that would fit.
    """
    width, height = (1e3 * side for side in config.size_m)
    # Around the pattern stays white: the outer squares must not touch the paper's edge.
    quiet = 0.3e3 * config.square_m
    for page_width, page_height in (PAPERS_MM[paper], PAPERS_MM[paper][::-1]):
        room = page_width - 2 * _MARGIN_MM, page_height - 2 * _MARGIN_MM - _FOOT_MM
        if width + quiet <= room[0] and height + quiet <= room[1]:
            page = PdfPage(page_width, page_height, f"ChArUco board, {config}")
            left, top = (page_width - width) / 2, _MARGIN_MM + (room[1] - height) / 2
            _draw_squares(page, config, left, top)
            _draw_markers(page, config, left, top)
            _draw_foot(page, config)
            return page.to_bytes()
    raise ConfigError(
        f"a board of {width:g} x {height:g} mm does not fit on {paper} "
        f"({PAPERS_MM[paper][0]:g} x {PAPERS_MM[paper][1]:g} mm with margins and ruler): "
        f"use squares of at most {_largest_square_mm(config, paper):.0f} mm, fewer squares, or a "
        "larger paper"
    )


def _largest_square_mm(config: BoardConfig, paper: Paper) -> float:
    columns, rows = config.squares
    sides = []
    for page_width, page_height in (PAPERS_MM[paper], PAPERS_MM[paper][::-1]):
        room = page_width - 2 * _MARGIN_MM, page_height - 2 * _MARGIN_MM - _FOOT_MM
        sides.append(min(room[0] / (columns + 0.3), room[1] / (rows + 0.3)))
    return float(np.floor(max(sides)))


def _draw_squares(page: PdfPage, config: BoardConfig, left: float, top: float) -> None:
    columns, rows = config.squares
    side = 1e3 * config.square_m
    # Boards of the old pattern with an even number of rows begin with a white square.
    first = 1 if config.legacy and rows % 2 == 0 else 0
    for row in range(rows):
        for column in range(columns):
            if (row + column) % 2 == first:
                page.rectangle(left + column * side, top + row * side, side, side)


def _draw_markers(page: PdfPage, config: BoardConfig, left: float, top: float) -> None:
    board = opencv_board(config)
    dictionary, cells = board.getDictionary(), config.marker_bits + 2
    side = 1e3 * config.marker_m
    module = side / cells
    numbers = np.asarray(board.getIds()).ravel()
    for number, corners in zip(numbers, board.getObjPoints(), strict=True):
        x, y = 1e3 * np.asarray(corners, dtype=float)[:, :2].min(axis=0) + [left, top]
        page.rectangle(x, y, side, side)
        white = cv2.aruco.generateImageMarker(dictionary, int(number), cells) > 127
        for row in range(cells):
            # Neighbouring white cells in one piece: viewers draw seams between pieces.
            edges = np.flatnonzero(np.diff(np.concatenate([[0], white[row].astype(int), [0]])))
            for begin, end in edges.reshape(-1, 2):
                page.erase(x + begin * module, y + row * module, (end - begin) * module, module)


def _draw_foot(page: PdfPage, config: BoardConfig) -> None:
    top, left = page.height_mm - _MARGIN_MM - _FOOT_MM + 4.0, _MARGIN_MM + 2.0
    page.rectangle(left, top, _RULER_MM, 0.25)
    for tick in range(0, _RULER_MM + 1, 5):
        long = tick % 10 == 0
        # The marks' left edges are exactly 5 mm apart.
        page.rectangle(left + tick, top, 0.2, 3.0 if long else 1.8)
        if long:
            page.text(left + tick - 0.8, top + 6.0, str(tick), 2.4)
    note = "mm. Print at 100 %, not fitted to the page; measure this ruler, then glue it flat."
    page.text(left + _RULER_MM + 6.0, top + 2.5, note, 2.4)
    page.text(left, top + 11.0, str(config), 3.0)
    page.text(left, top + 15.5, definition(config), 2.4)


def definition(config: BoardConfig) -> str:
    """The lines for the rig's configuration, as one line of YAML."""
    columns, rows = config.squares
    legacy = ", legacy: true" if config.legacy else ""
    return (
        f"board: {{squares: [{columns}, {rows}], square_m: {config.square_m:g}, "
        f"marker_m: {config.marker_m:g}, dictionary: {config.dictionary}{legacy}}}"
    )
