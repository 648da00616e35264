"""What a renderer is to the simulated camera."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Renderer(Protocol):
    """Draws the scene without noise; used by one thread at a time."""

    name: str  # "raster" or "gl"

    def render(self, T_base_camera: FloatArray, rows: tuple[int, int]) -> NDArray[np.float32]:
        """The mean radiance over the poses (k, 4, 4) of the image rows [from, to).

        Grey levels 0..255, (rows, width).
        """
        ...

    def close(self) -> None:
        """Release what the renderer holds; harmless when repeated."""
        ...
