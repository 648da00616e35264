"""Finding the board's corners in an image, or the reason why they cannot be used."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.calibration.board import BoardConfig, corner_points, opencv_board
from rig.calibration.board_pose import MIN_CORNERS
from rig.calibration.corner_fit import fit_corners
from rig.calibration.sharpness import edge_width_px
from rig.calibration.views import BoardView

FloatArray = NDArray[np.float64]
GreyImage = NDArray[np.uint8]

_BLURRED_PX = 4.5  # edges wider than this are out of focus or smeared
_OFF_PLANE = 0.10  # of a square: markers further from where the layout has them are misplaced
_WINDOW = 0.85  # of the way from a corner to the nearest marker
_OTHER_DICTIONARIES = ("DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000")


@dataclass(frozen=True, slots=True)
class Detection:
    """What an image shows of the board; ``view`` is None when ``reason`` says why not."""

    view: BoardView | None
    reason: str
    markers: int
    edge_width_px: float  # infinite without corners


class BoardDetector:
    """Finds one board; reuse it from image to image."""

    def __init__(self, config: BoardConfig, min_corners: int = MIN_CORNERS) -> None:
        self._config = config
        self._min_corners = max(min_corners, MIN_CORNERS)
        self._points = corner_points(config)
        board = opencv_board(config)
        self._markers = np.array([np.asarray(c)[:, :2] for c in board.getObjPoints()])
        # The detector drops boards whose markers and corners do not match; here that is a
        # reason of its own, with a better test.
        parameters = cv2.aruco.CharucoParameters()
        if hasattr(parameters, "checkMarkers"):  # OpenCV 4.12; before, its own test comes first
            parameters.checkMarkers = False
        self._detector = cv2.aruco.CharucoDetector(board, parameters)

    def find(self, image: GreyImage, fine: bool = True) -> Detection:
        """The corners in a grey image (height, width), to a hundredth of a pixel.

        Not ``fine``: to a few hundredths, in a third of the time. Pixel centres lie at integer
        coordinates.
        """
        try:
            corners, ids, markers, marker_ids = self._detector.detectBoard(image)
        except cv2.error as error:
            # A board seen edge-on, or patches of one elsewhere, can break its interpolation.
            return _nothing(f"the corners could not be located ({error.err})")
        count = 0 if marker_ids is None else len(marker_ids)
        if count == 0:
            return _nothing(self._why_no_markers(image))
        wrong = self._misplaced(
            np.asarray(markers, dtype=float)[:, 0], np.asarray(marker_ids, dtype=int).ravel()
        )
        if wrong:
            return _nothing(wrong, count)
        found = 0 if ids is None else len(ids)
        enough = found >= self._min_corners
        rough = np.asarray(corners if enough else markers, dtype=float).reshape(-1, 2)
        width = edge_width_px(image, rough)
        if width > _BLURRED_PX:
            reason = (
                f"the image is blurred (edges {width:.1f} px wide): let the arm settle, focus, or "
                "shorten the exposure"
            )
            return Detection(None, reason, count, width)
        if not enough:
            reason = (
                f"{found} corners of the board in view, {self._min_corners} needed: "
                "show more of it, unobstructed and evenly lit"
            )
            return Detection(None, reason, count, width)
        numbers = np.asarray(ids).ravel().astype(np.int64)
        points = self._points[numbers]
        pixels = self._refined(image, rough)
        if fine:
            board = self._config
            pixels = fit_corners(image, pixels, points[:, :2], board.square_m, board.marker_m)
        return Detection(BoardView(numbers, points, pixels), "", count, width)

    def _refined(self, image: GreyImage, pixels: FloatArray) -> FloatArray:
        """The corners found anew in the largest windows that reach no marker.

        The detector's own windows are set by the markers alone and are off by up to 0.2 px
        where the board is seen at a slant.
        """
        apart = np.linalg.norm(pixels[:, None] - pixels[None], axis=2)
        side_px = float(np.min(apart + np.where(apart == 0.0, np.inf, 0.0)))
        gap = (self._config.square_m - self._config.marker_m) / (2.0 * self._config.square_m)
        half = int(np.clip(_WINDOW * gap * side_px, 2, 7))
        out = pixels.astype(np.float32).reshape(-1, 1, 2)
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-3)
        cv2.cornerSubPix(image, out, (half, half), (-1, -1), criteria)
        return np.asarray(out[:, 0], dtype=float)

    def _misplaced(self, seen: FloatArray, ids: NDArray[np.int64]) -> str:
        """What is wrong with where the markers (k, 4, 2) are; empty if nothing."""
        most = len(self._markers)
        if np.any(ids >= most):
            return (
                f"wrong board: marker {int(ids.max())} is in view, the board as defined "
                f"({self._config}) has 0 to {most - 1}"
            )
        if len(ids) < 2:
            return ""
        planned = self._markers[ids].reshape(-1, 2)
        pixels = seen.reshape(-1, 2)
        # None when there is no homography, whatever its type hints promise.
        H = np.asarray(cv2.findHomography(pixels, planned, cv2.LMEDS)[0], dtype=float)
        if H.shape != (3, 3):
            return "the markers in view lie on one line: show more of the board"
        mapped = cv2.perspectiveTransform(pixels[None], H)[0]
        off = np.linalg.norm(mapped - planned, axis=1) / self._config.square_m
        if float(np.mean(off > _OFF_PLANE)) > 0.4:
            return (
                f"wrong board: the markers in view do not lie as on the defined one "
                f"({self._config}); check the number of squares, marker_m / square_m and legacy, "
                "and that the image is not mirrored"
            )
        return ""

    def _why_no_markers(self, image: GreyImage) -> str:
        for name in _OTHER_DICTIONARIES:
            if name[:8] == self._config.dictionary[:8]:
                continue
            other = cv2.aruco.getPredefinedDictionary(int(getattr(cv2.aruco, name)))
            _, ids, _ = cv2.aruco.ArucoDetector(other).detectMarkers(image)
            if ids is not None and len(ids) >= 3:
                return (
                    f"wrong board: its markers are of {name.rsplit('_', 1)[0]}_*, the definition "
                    f"says {self._config.dictionary}"
                )
        spread = float(np.percentile(image, 95) - np.percentile(image, 5))
        if spread < 20:
            return f"no board in view: the image is nearly uniform (contrast {spread:.0f} of 255)"
        return "no board in view (or far out of focus, too small, or mirrored)"


def _nothing(reason: str, markers: int = 0) -> Detection:
    return Detection(None, reason, markers, float("inf"))
