"""What was seen of the board: corners of one image, with the arm's pose where there is one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BoardView:
    """The corners of the board that one image shows."""

    ids: NDArray[np.int64]  # (n,) numbers of the corners on the board
    points_m: FloatArray  # (n, 3) in the board's frame
    pixels: FloatArray  # (n, 2)

    def __len__(self) -> int:
        return len(self.ids)

    def only(self, kept: NDArray[np.bool_]) -> "BoardView":
        """The view reduced to the corners where ``kept`` (n,) holds."""
        return BoardView(self.ids[kept], self.points_m[kept], self.pixels[kept])


@dataclass(frozen=True, slots=True)
class PosedView:
    """A view together with where the arm stood."""

    board: BoardView
    T_base_tool: FloatArray  # (4, 4)


@dataclass(frozen=True, slots=True)
class StampedView:
    """A view together with the image's own stamp."""

    board: BoardView
    t_s: float


@dataclass(frozen=True, slots=True)
class Stack:
    """Several views as arrays of equal length; where a view has fewer corners, ``seen`` is 0."""

    points_m: FloatArray  # (m, n, 3)
    pixels: FloatArray  # (m, n, 2)
    seen: FloatArray  # (m, n) 1 or 0

    def __len__(self) -> int:
        return len(self.seen)

    @property
    def corners(self) -> int:
        """How many corners there are in all."""
        return int(self.seen.sum())

    def only(self, which: NDArray[np.intp] | NDArray[np.bool_]) -> "Stack":
        """The views chosen by index or mask."""
        return Stack(self.points_m[which], self.pixels[which], self.seen[which])


def stack(views: Sequence[BoardView]) -> Stack:
    """The views side by side; corners that are missing stand on the board's first point."""
    m, n = len(views), max((len(view) for view in views), default=0)
    points, pixels, seen = np.zeros((m, n, 3)), np.zeros((m, n, 2)), np.zeros((m, n))
    for i, view in enumerate(views):
        k = len(view)
        points[i, :k], pixels[i, :k], seen[i, :k] = view.points_m, view.pixels, 1.0
        points[i, k:] = view.points_m[:1] if k else 0.0
    return Stack(points, pixels, seen)
