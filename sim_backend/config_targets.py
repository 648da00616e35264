"""What the simulated rig can look at, and from where it looks first."""

import math
import re
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from sim_backend.config_section import Grey, NotNegative, Positive, Section, Vec3

Tilt = Annotated[float, Field(ge=-75.0, le=75.0)]
Squares = Annotated[int, Field(ge=3, le=50)]

_DICTIONARY = re.compile(r"DICT_([4-7])X\1_(50|100|250|1000)")
_LEAST_HEIGHT_M = 1e-3  # of the board above the floor


class StartPose(Section):
    """Where the camera starts, seen from the target.

    The camera first looks straight down with its x along base x (at a board: straight at it,
    with its x along the board's rows); it is then tilted about base x, about base y, spun about
    its optical axis, and moved so that the target's reference point lies ``distance_m`` from the
    camera's centre and ``offset_px`` from the principal point (before lens distortion).
    """

    distance_m: Positive
    tilt_x_deg: Tilt = 0.0
    tilt_y_deg: Tilt = 0.0
    spin_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 0.0
    offset_px: tuple[float, float] = (0.0, 0.0)


class SphereStart(StartPose):
    """By default an orbit along −x of the camera at 0.05 m/s passes over the top in 3 s."""

    distance_m: Positive = 0.27
    tilt_x_deg: Tilt = 6.0
    tilt_y_deg: Tilt = 32.0
    offset_px: tuple[float, float] = (14.0, -9.0)


class CylinderStart(StartPose):
    """By default 6 s of approaching at 0.06 m/s end 0.2 m from the axis."""

    distance_m: Positive = 0.55
    offset_px: tuple[float, float] = (10.0, -12.0)


class BoardStart(StartPose):
    """By default the whole board is in view, a little askew."""

    distance_m: Positive = 0.42
    tilt_x_deg: Tilt = 14.0
    tilt_y_deg: Tilt = -10.0
    spin_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 8.0
    offset_px: tuple[float, float] = (-12.0, 8.0)


class SphereConfig(Section):
    """The spherical target."""

    radius_m: Positive = 0.019
    albedo_grey: Grey = 225.0
    position_m: Vec3 = (0.0, 0.0, 0.30)  # centre, in base
    start: SphereStart = SphereStart()


class CylinderConfig(Section):
    """The cylindrical target; by default its axis lies at 60° in the image, towards +x, +y."""

    radius_m: Positive = 0.042
    albedo_grey: Grey = 225.0
    position_m: Vec3 = (0.0, 0.0, 0.30)  # middle of the axis, in base
    direction: Vec3 = (0.5, -0.8660254037844386, 0.0)  # of the axis, in base; any length
    length_m: Positive = 1.2
    start: CylinderStart = CylinderStart()


class BoardConfig(Section):
    """The ChArUco board that calibration looks at, as it really is: printed well or not.

    Its frame is OpenCV's: x along the rows and y down the columns of the print, z away from the
    viewer; the origin is the pattern's first corner.
    """

    visible: bool = True
    squares: tuple[Squares, Squares] = (7, 5)  # a row, a column
    square_m: Positive = 0.030
    marker_m: Positive = 0.022
    dictionary: str = "DICT_4X4_50"  # of OpenCV's; or 5X5, 6X6, 7X7 and 100, 250, 1000
    legacy: bool = False  # as OpenCV before 4.6 laid out boards with an even number of rows
    margin_m: NotNegative = 0.010  # white paper around the pattern
    white_grey: Grey = 225.0
    black_grey: Grey = 25.0
    position_m: Vec3 = (0.0, 0.0, 0.30)  # of the pattern's middle, in base
    rotvec_rad: Vec3 = (math.pi, 0.0, 0.0)  # of its axes, in base: it lies face up
    start: BoardStart = BoardStart()

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of the pattern."""
        return self.squares[0] * self.square_m, self.squares[1] * self.square_m

    @model_validator(mode="after")
    def _printable(self) -> Self:
        if self.marker_m >= self.square_m:
            raise ValueError(
                f"board.marker_m = {self.marker_m:g} must be smaller than "
                f"board.square_m = {self.square_m:g}"
            )
        known = _DICTIONARY.fullmatch(self.dictionary)
        if known is None:
            raise ValueError(
                f"board.dictionary = {self.dictionary!r} is none of DICT_NXN_M "
                "with N = 4, 5, 6, 7 and M = 50, 100, 250, 1000"
            )
        markers, most = self.squares[0] * self.squares[1] // 2, int(known[2])
        if markers > most:
            raise ValueError(
                f"board.squares need {markers} markers, but {self.dictionary} has {most}"
            )
        return self

    @model_validator(mode="after")
    def _above_the_floor(self) -> Self:
        half = np.array(self.size_m) / 2 + self.margin_m
        axes = Rotation.from_rotvec(self.rotvec_rad).as_matrix()
        lowest_m = self.position_m[2] - float(np.abs(axes[2, :2]) @ half)
        if lowest_m < _LEAST_HEIGHT_M:
            raise ValueError(
                "board.position_m puts the board into the floor: its lowest corner is at "
                f"z = {lowest_m:.4g} m"
            )
        return self


class SphereObject(Section):
    """A further sphere in view."""

    radius_m: Positive
    position_m: Vec3
    albedo_grey: Grey = 160.0


class CylinderObject(Section):
    """A further cylinder in view, with flat ends."""

    radius_m: Positive
    position_m: Vec3
    direction: Vec3
    length_m: Positive
    albedo_grey: Grey = 160.0
